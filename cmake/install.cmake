include(CMakePackageConfigHelpers)
install(TARGETS mjenv EXPORT mjenv-targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY capi/include/mjenv DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT mjenv-targets NAMESPACE mjenv:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mjenv)
configure_package_config_file(cmake/mjenv-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mjenv)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/mjenv-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mjenv)
file(RELATIVE_PATH MJENV_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/mjenv.pc.in mjenv.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/mjenv.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
