"""The paper's three steps on face normals: noise is removed and edges are kept."""
