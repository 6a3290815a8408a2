"""Grid and discs together against closed forms and identities."""

from verification.coupling import bits, chain, energy, fall, flutter, mapping, patch, restitution, rigid, waves

TITLE = "Coupling"
HEAD = """Grid and discs with the interface between them. The case "same bits" runs scenes as `colluvium run` does; the others
join the product's own kernels of both codes in its order of steps, in real time with the step that the product would agree
on, for bars, chains and lattices that no scene can say. Long bars stand in for half-infinite ones."""
CASES = [mapping, rigid, patch, fall, chain, energy, waves, restitution, flutter, bits]
