# Makes Debian packages by `cpack`: libmjenv1 contains the library, libmjenv-dev the headers and the static library.
# Configure with -DCMAKE_INSTALL_PREFIX=/usr, so that the library goes where Debian looks for it.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "mjenv maintainers <mjenv@example.org>")
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(text "Gymnasium's 22 MuJoCo environments, with the same results bit for bit, for\nC, C++, Rust, Julia and Python, without a Python process.")

set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "${text}")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libmjenv1)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
if(CMAKE_CROSSCOMPILING)  # Debian's tools find no libraries of another architecture
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libc6 (>= 2.28), libgcc-s1 (>= 3.0)")
else()
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
endif()
# The library loads these when it draws a picture.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "libegl1, libgl1-mesa-dri, libglfw3, libosmesa6")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)

set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "${text}\nThis package holds the headers and the static library.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libmjenv-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libmjenv1 (= ${PROJECT_VERSION}-1)")

# Debian keeps the text of the Apache licence, which is also MuJoCo's licence, in a place of its own.
set(copyright ${CMAKE_CURRENT_BINARY_DIR}/generated/copyright)
set(content "mjenv, and MuJoCo inside it: Apache-2.0, see /usr/share/common-licenses/Apache-2.0\n")
foreach(library eigen3 glibc json libccd lodepng qhull tinyxml2 tinyobjloader)
  if(EXISTS ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/${library}.txt)
    file(READ ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/${library}.txt license)
    string(APPEND content "\n${library}:\n\n${license}")
  endif()
endforeach()
file(WRITE ${copyright} "${content}")
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/generated/changelog.Debian "mjenv (${PROJECT_VERSION}-1) unstable; urgency=medium\n
  * Version ${PROJECT_VERSION}; its changes are in CHANGELOG.md of the sources.\n
 -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
execute_process(COMMAND gzip -9nf ${CMAKE_CURRENT_BINARY_DIR}/generated/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
foreach(package "libmjenv1;runtime" "libmjenv-dev;development")
  list(POP_FRONT package name)
  install(FILES ${copyright} ${CMAKE_CURRENT_BINARY_DIR}/generated/changelog.Debian.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${package} EXCLUDE_FROM_ALL)
endforeach()
include(CPack)
