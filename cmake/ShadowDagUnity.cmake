# SPDX-License-Identifier: Apache-2.0
# SDAG_UNITY: the files of a library are compiled together, up to 32 at a time. Headers, of which JSON's alone take four
# seconds, are then read and instantiated once for 32 files; each compiler process then needs 1 GiB. Names in anonymous namespaces
# must therefore be unique within a library.
set(SDAG_UNITY_SIZE 32)
# Files that share such names, as the built-in scenes share their Materials, those that register passes, and the one
# with the macros of X11: compiled alone.
string(JOIN "|" SDAG_UNITY_ALONE
  scenes/builtin_ scenes/triangle_tree
  voxel/asset voxel/compact_encoding voxel/part_file voxel/openvdb_ voxel/nanovdb_file
  hybrid/frame/frame_state hybrid/judge/flicker hybrid/judge/truth[.]cpp
  shadowmap/shadow_maps[.]cpp
  tools/bench/bench_voxel tools/commands/fit_command tools/window/view_display
  "[a-z/]*passes[.]cpp")

# sdag_unite(target) groups the target's C++ sources in their order. CMake itself excludes sources with separate options.
function(sdag_unite target)
  get_target_property(sources ${target} SOURCES)
  get_target_property(targetFolder ${target} SOURCE_DIR)
  set(united)
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${targetFolder} NORMALIZE)
    cmake_path(IS_PREFIX PROJECT_SOURCE_DIR "${source}" NORMALIZE isOurs)
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR "${source}" NORMALIZE isGenerated)
    if(NOT isOurs OR isGenerated OR NOT source MATCHES "[.]cpp$" OR source MATCHES "/(${SDAG_UNITY_ALONE})")
      continue()
    endif()
    list(APPEND united ${source})
  endforeach()
  # Groups of equal size, so that no small group reads all headers again.
  list(LENGTH united count)
  math(EXPR groupCount "(${count} + ${SDAG_UNITY_SIZE} - 1) / ${SDAG_UNITY_SIZE}")
  set(number 0)
  foreach(source IN LISTS united)
    math(EXPR group "${number} * ${groupCount} / ${count}")
    math(EXPR number "${number} + 1")
    set_property(SOURCE ${source} TARGET_DIRECTORY ${target} PROPERTY UNITY_GROUP ${target}_${group})
  endforeach()
  sdag_compile_groups(${target})
endfunction()

# sdag_unite_groups(target a.cpp b.cpp | c.cpp ...) groups the target's sources as the bars do.
function(sdag_unite_groups target)
  set(group 0)
  foreach(source ${ARGN})
    if(source STREQUAL "|")
      math(EXPR group "${group} + 1")
    else()
      set_property(SOURCE ${source} PROPERTY UNITY_GROUP ${target}_${group})
    endif()
  endforeach()
  sdag_compile_groups(${target})
endfunction()

function(sdag_compile_groups target)
  # GCC treats a type that one of the files defines as a header's, and warns about its members from anonymous
  # namespaces.
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
