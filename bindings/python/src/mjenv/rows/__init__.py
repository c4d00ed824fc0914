"""Rows and arrays: what the outputs of a step, the arrays of the simulation and the pictures of rows are in Python."""
