# Makes mjenv.dll and mjenv.lib, which programs are linked to. The library exports what MJENV_API marks, and contains the
# compiler's libraries, so that it needs Windows' own alone.
target_compile_definitions(mjenv PRIVATE MJENV_BUILDING)
target_compile_definitions(mjenv_core PUBLIC MJENV_BUILDING)
set_target_properties(mjenv PROPERTIES PREFIX "" IMPORT_PREFIX "" IMPORT_SUFFIX .lib)
target_link_options(mjenv PRIVATE -static)
target_link_libraries(mjenv_core PUBLIC ssp bcrypt synchronization)  # ssp: what guarded stacks and copies call
