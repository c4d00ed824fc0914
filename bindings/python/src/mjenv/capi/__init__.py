"""The C interface: its declarations in ctypes, the libraries that are loaded, handles, errors and descriptions.

Programs beside the wrapper may use these modules. `mjenv.capi.handle.Rows` is an environment as the library has it.
"""
