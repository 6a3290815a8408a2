"""The table `[accuracy]` of a scene: closed forms of its quantities, for `colluvium accuracy`."""

from pydantic import Field, model_validator

from coupler_protocol.scene.declare import Table, quantity


class ClosedForm(Table):
    """A quantity whose value is known without computing the scene."""

    of: str = quantity(meaning="quantity as after `--of` of `colluvium accuracy`", min_length=1)
    value: float = quantity(meaning="its value, SI units")
    source: str = quantity(meaning="where the value comes from", min_length=1)


class Accuracy(Table):
    """References of `colluvium accuracy` (docs/accuracy.md). `colluvium run` does not use this table; no result depends on it."""

    reference: list[ClosedForm] = Field(description="quantities with a closed form or a published value", min_length=1)

    @model_validator(mode="after")
    def _named_once(self) -> "Accuracy":
        names = [_plain(one.of) for one in self.reference]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"{twice} has two references: remove one")
        return self

    def reference_of(self, text: str) -> ClosedForm | None:
        """The reference of the quantity that a text describes, or None."""
        return next((one for one in self.reference if _plain(one.of) == _plain(text)), None)


def _plain(text: str) -> str:
    """A quantity without spaces: `stress_xx(0, 2)` and `stress_xx(0,2)` are the same."""
    return "".join(text.split())
