# SPDX-License-Identifier: Apache-2.0
# Every third-party library and its target. packages.txt lists the Debian package of each.
# docs/method.md says which folder may include which library; tests/house/include_order.py enforces it.
find_package(Threads REQUIRED)                 # Threads::Threads
find_package(TBB CONFIG REQUIRED)              # TBB::tbb; must stay before OpenVDB, whose modules shadow its config
find_package(glm CONFIG REQUIRED)              # glm::glm
find_package(TinyGLTF CONFIG REQUIRED)         # TinyGLTF::TinyGLTF; compiled: never define TINYGLTF_IMPLEMENTATION
find_package(meshoptimizer CONFIG REQUIRED)    # meshoptimizer::meshoptimizer
find_package(draco CONFIG REQUIRED)            # draco::draco, always through TinyGLTF::TinyGLTF
# Debian's Draco exports another version of tinygltf by the same names, which replaces ours, and crashes, where it comes
# first. As a dependency of ours it comes after it, in every program.
set_property(TARGET TinyGLTF::TinyGLTF APPEND PROPERTY INTERFACE_LINK_LIBRARIES draco::draco)
find_package(zstd CONFIG REQUIRED)             # zstd::libzstd_shared
# embree, of either version; hybrid/rays/embree_version.h prefers the same one
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3.13 REQUIRED)
endif()
set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)            # Imath's config reports at length that Debian packs PyImath apart
find_package(Imath CONFIG REQUIRED)            # Imath::Imath
find_package(OpenEXR CONFIG REQUIRED)          # OpenEXR::OpenEXR
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_package(CLI11 CONFIG REQUIRED)            # CLI11::CLI11
find_package(nlohmann_json CONFIG REQUIRED)    # nlohmann_json::nlohmann_json
find_package(JPEG REQUIRED)                    # JPEG::JPEG
find_package(PkgConfig REQUIRED)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET GLOBAL libxxhash)    # PkgConfig::xxhash
pkg_check_modules(stb REQUIRED IMPORTED_TARGET GLOBAL stb)             # PkgConfig::stb
pkg_check_modules(muparser REQUIRED IMPORTED_TARGET GLOBAL muparser)   # PkgConfig::muparser
if(SDAG_TESTS)
  find_package(GTest CONFIG REQUIRED)          # GTest::gtest, GTest::gmock
  # The checks of tests/house and the charts' test. Debian's own first: only that one has Debian's matplotlib.
  find_program(SDAG_PYTHON python3 HINTS /usr/bin NO_CACHE REQUIRED)
endif()

# Finds OpenVDB and NanoVDB: targets OpenVDB::openvdb, OpenVDB::nanovdb, and their compressors, ZLIB::ZLIB and
# Blosc::blosc. Called by the folders that include them.
# A function, because Debian's module folder would otherwise shadow the configs of TBB and OpenEXR.
function(sdag_find_openvdb)
  if(TARGET OpenVDB::openvdb AND TARGET OpenVDB::nanovdb)
    return()
  endif()
  list(APPEND CMAKE_MODULE_PATH ${CMAKE_SYSROOT}/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
  find_package(OpenVDB REQUIRED COMPONENTS openvdb nanovdb)
  find_package(ZLIB REQUIRED)
  find_package(Blosc REQUIRED)
endfunction()
pkg_check_modules(epoxy REQUIRED IMPORTED_TARGET GLOBAL epoxy)         # PkgConfig::epoxy; loads OpenGL and EGL
pkg_check_modules(imgui REQUIRED IMPORTED_TARGET GLOBAL imgui)         # PkgConfig::imgui, with its GLFW and OpenGL back ends
find_package(glfw3 3.3 CONFIG REQUIRED)                                # glfw
find_package(X11 REQUIRED)                                             # X11::X11
