"""Many meshes: each by itself, in processes that may die, with a record of what is done."""
