"""The live viewer: environments in a browser, here or on another computer.

``python -m mjenv view ID`` steps an environment itself (session.py), and ``with mjenv.view(envs):`` shows one that a
program steps (watch.py). viser serves the page and draws it: pip install "mjenv[view]". Importing mjenv imports none of
that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjenv.viewer.watch import View


def view(
    env: Any,
    *,
    rows: int = 16,
    port: int | None = None,
    host: str = "127.0.0.1",
    share: float = 0.02,
    quiet: bool = False,
) -> View:
    """Shows an environment in a browser while the program steps it: ``with mjenv.view(envs): train(envs)``.

    env: what make or make_vec gives, also inside of Gymnasium's wrappers, or mjenv.sb3's. rows: how many rows are drawn
    at most, the first ones. port: of the page; None for the first free one from 8080 on. host: the address that is
    listened at, by default that of this computer alone. share: the part of the program's time that drawing may take.
    quiet: do not print the address, which the attribute `address` holds.

    The results keep every bit, except where the user pulls a body. Needs pip install "mjenv[view]". One thread steps
    the environment. Copies and pickles of it are not shown.
    """
    from mjenv.viewer.watch import View

    return View(env, rows=rows, port=port, host=host, share=share, quiet=quiet)
