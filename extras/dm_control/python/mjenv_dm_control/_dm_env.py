"""dm_env, or an error that says how to install it."""

try:
    import dm_env
    from dm_env import specs
except ImportError as error:
    raise ImportError(f'mjenv_dm_control needs dm_env: pip install "mjenv[dm_control]" ({error})') from error

__all__ = ["dm_env", "specs"]
