"""The live viewer: environments in a browser, here or on another computer.

``python -m mjenv view ID`` steps an environment itself (session.py), and ``with mjenv.view(envs):`` shows one that a
program steps (watch.py). viser serves and draws the page: pip install "mjenv[view]". Importing mjenv does not import
these modules.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mjenv_viewer.watch import View


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

    env: from make or make_vec, also inside of Gymnasium's wrappers, or from mjenv_sb3. rows: the first `rows` rows are
    drawn. port: of the page; None: the first free port from 8080 on. host: the address at which the page is served, by
    default that of this computer alone. share: the part of the program's time that drawing may take. quiet: do not
    print the page's address, which the attribute `address` has: it ends in a random token, without which the server
    answers nothing.

    The viewer changes no bit of the results, unless the user pulls a body or writes a live parameter. Needs pip install
    "mjenv[view]". One thread steps the environment. Copies and pickles of it are not shown.
    """
    from mjenv_viewer.panels.watch import WatchPanel
    from mjenv_viewer.watch import View

    shown = View(env, rows=rows, port=port, host=host, share=share, quiet=quiet)
    try:
        WatchPanel(shown)
    except BaseException:
        shown.close()
        raise
    return shown
