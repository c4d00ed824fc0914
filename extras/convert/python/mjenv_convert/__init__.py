"""Converts models of MuJoCo 4.0 to what MuJoCo 2.2.2 reads."""
