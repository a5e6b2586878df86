"""The tests, in the same rooms as the package: laws and closed forms, on meshes made in code or from pymeshlab."""
