"""Gymnasium's API: environments, vector environments, and the ids that Gymnasium knows."""
