"""Pictures: the only room that knows the renderer."""
