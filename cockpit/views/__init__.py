"""The 3D scene of a site, drawn with viser: nodes are made once, then properties are set."""
