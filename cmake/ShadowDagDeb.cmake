# SPDX-License-Identifier: Apache-2.0
# The target `package`: a .deb of what `cmake --install` installs and of the documentation site, which ./do docs builds.
# Dependencies on libraries are found by dpkg-shlibdeps. stage_deb.cmake arranges the files before they are packed.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME shadowdag)
set(CPACK_PACKAGE_CONTACT "The ShadowDAG developers")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libegl1, python3-matplotlib, python3-jinja2, python3-pandas")
# What a program over the static libraries needs to be linked.
file(STRINGS packages.txt developed REGEX "^lib.*-dev$")
list(FILTER developed EXCLUDE REGEX "gtest|gmock|benchmark|cli11|imgui|glfw|x11|xtst|clang")
list(JOIN developed ", " CPACK_DEBIAN_PACKAGE_SUGGESTS)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/stage_deb.cmake)
# Read by stage_deb.cmake.
set(CPACK_SDAG_SITE ${PROJECT_SOURCE_DIR}/build/docs/html)
set(CPACK_SDAG_DOCDIR ${CMAKE_INSTALL_DOCDIR})
set(CPACK_SDAG_PYTHON_DIR)
if(SDAG_WITH_PYTHON)
  set(CPACK_SDAG_PYTHON_DIR ${SDAG_PYTHON_DIR})
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS " (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
endif()
include(CPack)
