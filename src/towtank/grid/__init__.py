"""Mesh-resolution study: the same runs on three or more meshes."""
