"""Lets gymnasium.make("mjenv/Ant-v5") work without an import of mjenv, as Gymnasium 1.0 and newer load no plug-ins.

mjenv.pth imports this module whenever Python starts. It waits until a program imports gymnasium, and imports mjenv only
then. It must never make that import fail, whichever Gymnasium is installed: every failure becomes a line on stderr.
"""

import contextlib
import sys


class _Finder:
    @classmethod
    def find_spec(cls, name, path=None, target=None):  # type: ignore[no-untyped-def]
        if name != "gymnasium":
            return None
        try:
            return cls._with_registration(name, path, target)
        except Exception as error:
            _complain(error)
            return None  # Python asks the other finders

    @classmethod
    def _with_registration(cls, name, path, target):  # type: ignore[no-untyped-def]
        others = [finder for finder in sys.meta_path if finder is not cls and hasattr(finder, "find_spec")]
        specs = (finder.find_spec(name, path, target) for finder in others)
        spec = next((spec for spec in specs if spec is not None), None)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module):  # type: ignore[no-untyped-def]
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register
        return spec


def _register():  # type: ignore[no-untyped-def]
    # If mjenv is being imported, it registers its ids itself.
    if "mjenv" not in sys.modules:
        try:
            import mjenv  # noqa: F401
        except Exception as error:
            _complain(error)


def _complain(error):  # type: ignore[no-untyped-def]
    # stderr may be closed, or None in a program without a console.
    with contextlib.suppress(Exception):
        sys.stderr.write(f"gymnasium knows no mjenv/ ids: {error}\n")


sys.meta_path.insert(0, _Finder)
