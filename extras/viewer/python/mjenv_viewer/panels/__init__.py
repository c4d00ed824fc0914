"""The tabs of the viewer's panel."""
