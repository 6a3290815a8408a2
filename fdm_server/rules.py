"""What a scene must fulfil so that the grid can be built; found by the scene reader through `colluvium.rules`."""

from fdm_server.boundary import fixed_components
from fdm_server.grid import build_grid
from fdm_server.windows import rim_of, window_zones


def grid_can_be_built(scene):
    """Profile, zone size, regions and boundaries fit together, and every window is whole zones with zones all around."""
    try:
        grid = build_grid(scene)
        fixed_components(grid, scene.boundary)
    except ValueError as error:
        yield ("grid",), str(error), ""
        return
    for i, window in enumerate(scene.window):
        try:
            rim_of(grid, window_zones(grid, window))
        except ValueError as error:
            yield ("window", i), str(error), ""
