"""The live viewer: environments in a browser, here or on another computer.

``python -m mjenv view ID`` steps an environment itself (Session), and ``with mjenv.view(envs):`` shows one that a
program steps. viser serves the page and draws it: pip install "mjenv[view]". Importing this imports none of that.
"""
