"""Table of report.html: fabric, forces, the stress-force-fabric identity and chains at the moments of the roses."""

from html import escape

from colluvium.figures import roses, style
from colluvium.results.run import Run

HEAD = (
    "moment", "contacts", "a", "θa [°]", "aₙ", "θₙ [°]", "aₜ", "θₜ [°]", "fit a, aₙ, aₜ", "sin φ", "predicted", "residual",
    "chains", "of the bodies", "direction [°]",
)  # fmt: skip
HINT = (
    "a, aₙ, aₜ: anisotropy of contact directions, normal and tangential forces, with 95 % intervals; fit: share of the variance "
    "over 18 bins of direction that the distributions explain; sin φ: (σ₁ - σ₂) / (σ₁ + σ₂) of the same contacts; predicted: "
    "by the stress-force-fabric identity; chains: bodies under more than the mean stress in line with each other "
    "(docs/measuring.md)."
)


def section(run: Run) -> str:
    """The table of the first window as HTML; "" if there are too few contacts."""
    if roses.missing(run):
        return ""
    rank = run.windows[0]
    cells = ("".join(f"<td>{escape(text)}</td>" for text in row(run, one.frame, rank)) for one in roses.shown(run))
    rows = "\n".join(f"<tr>{line}</tr>" for line in cells)
    head = "".join(f"<th>{escape(text)}</th>" for text in HEAD)
    return f'<table><thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody></table>\n<p class="hint">{escape(HINT)}</p>'


def row(run: Run, frame: int, rank: int) -> list[str]:
    """Texts of one moment."""
    found, chains = run.stress_force_fabric(frame, rank), run.force_chains(frame, rank)
    f = found.fabric
    sizes = ((f.a, f.a_interval), (f.a_n, f.a_n_interval), (found.a_t, found.a_t_interval))
    angles = ((f.theta_a, f.theta_a_error), (f.theta_n, f.theta_n_error), (found.theta_t, found.theta_t_error))
    of_each = [
        text
        for (size, (low, high)), (angle, error) in zip(sizes, angles, strict=True)
        for text in (f"{size:.3f} ({low:.3f} .. {high:.3f})", "-" if error >= 90.0 else f"{angle:.0f} ± {error:.0f}")
    ]
    fits = ", ".join(f"{share:.2f}" for share in (found.fit_a, found.fit_n, found.fit_t))
    return [
        style.moment(run.frames[frame]), f"{f.contacts:,}", *of_each, fits,
        f"{found.sine:.3f}", f"{found.predicted:.3f}", f"{found.residual:+.3f}",
        f"{chains.chains}", f"{chains.share:.0%}", f"{chains.direction:.0f}" if chains.chains else "-",
    ]  # fmt: skip
