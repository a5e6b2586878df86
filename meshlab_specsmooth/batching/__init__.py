"""Process many meshes, each in a process of its own, with a record of what is finished."""
