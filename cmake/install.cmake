# Says what `cmake --install` copies. The libraries on MuJoCo 2.2.2 and on MuJoCo 4.0 can be installed into one prefix.
# Their files have different names, except for those that are the same in both: what extras/ adds, the headers, LICENSE and
# the CMake package.
include(CMakePackageConfigHelpers)
set(cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/mjenv)
install(TARGETS mjenv EXPORT ${MJENV_LIBRARY_NAME}-targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)  # on Windows, what programs are linked to
install(DIRECTORY capi/include/mjenv DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
if(MJENV_ENGINE_VERSION MATCHES "^4")
  set_property(TARGET mjenv PROPERTY EXPORT_NAME mujoco4)
endif()
install(EXPORT ${MJENV_LIBRARY_NAME}-targets NAMESPACE mjenv:: DESTINATION ${cmake_folder} COMPONENT development)
configure_package_config_file(cmake/mjenv-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config.cmake
                              INSTALL_DESTINATION ${cmake_folder} PATH_VARS CMAKE_INSTALL_LIBDIR CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/mjenv-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/mjenv-config-version.cmake
              ${CMAKE_CURRENT_SOURCE_DIR}/cmake/mjenv-tasks.cmake
        DESTINATION ${cmake_folder} COMPONENT development)
file(RELATIVE_PATH MJENV_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
set(MJENV_PC_LIBS "-L\${libdir} -l${MJENV_LIBRARY_NAME}")
configure_file(cmake/mjenv.pc.in ${MJENV_LIBRARY_NAME}.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${MJENV_LIBRARY_NAME}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
if(MJENV_STATIC)
  set(MJENV_PC_LIBS "\${libdir}/libmjenv.a -lstdc++ -lm -lpthread -ldl")
  configure_file(cmake/mjenv.pc.in mjenv-static.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/mjenv-static.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endif()

install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documents)
if(PROJECT_IS_TOP_LEVEL AND NOT WIN32 AND MJENV_ENGINE_VERSION STREQUAL "2.2.2")
  include(debian)
endif()
