"""Lets gymnasium.make("mjenv/Ant-v5") work without an import of mjenv, as Gymnasium 1.0 and newer load no plug-ins.

mjenv.pth imports this whenever Python starts. It waits for the import of gymnasium, and only then imports mjenv.
"""

import sys


class _Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):  # type: ignore[no-untyped-def]
        if name != "gymnasium":
            return None
        from importlib.machinery import PathFinder

        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module):  # type: ignore[no-untyped-def]
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register
        return spec


def _register():  # type: ignore[no-untyped-def]
    # An mjenv that is being imported registers its ids itself.
    if "mjenv" not in sys.modules:
        try:
            import mjenv  # noqa: F401
        except ImportError as error:
            print(f"gymnasium knows no mjenv/ ids: {error}", file=sys.stderr)


sys.meta_path.insert(0, _Finder)
