"""Grid and discs together against closed forms and identities."""

from verification.coupling import bits, chain, energy, fall, flutter, mapping, patch, restitution, rigid, waves

TITLE = "Coupling"
HEAD = """Grid and discs with the interface between them. The case "same bits" runs scenes as `colluvium run` does. The others
couple the kernels of both codes in the program's order of steps, in real time with the step on which the program would agree,
for bars, chains and lattices that a scene cannot describe. Long bars represent half-infinite ones."""
CASES = [mapping, rigid, patch, fall, chain, energy, waves, restitution, flutter, bits]
