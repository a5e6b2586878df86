"""Between MeshSets and arrays: the only room that knows pymeshlab."""
