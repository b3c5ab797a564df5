# SPDX-License-Identifier: Apache-2.0
# The functions that the folders' CMakeLists.txt use.

# sdag_add_library(sdag_x a.cpp b.cpp ... LIBS sdag_cuda glm::glm ... PRIVATE_LIBS zstd::libzstd_shared ...)
# adds a static library with our flags, the alias ShadowDAG::sdag_x, and its installation. LIBS are public.
function(sdag_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBS;PRIVATE_LIBS")
  add_library(${name} STATIC ${arg_UNPARSED_ARGUMENTS})
  add_library(ShadowDAG::${name} ALIAS ${name})
  target_link_libraries(${name} PUBLIC sdag_flags ${arg_LIBS} PRIVATE ${arg_PRIVATE_LIBS})
  set_property(GLOBAL APPEND PROPERTY SDAG_LIBRARIES ${name})
endfunction()

# sdag_load_modules(target a_library ...) makes a program that links one of the libraries which load modules build these
# first. It finds them by DT_RPATH: of DT_RUNPATH the loader takes that of the caller, which sanitizers are for dlopen.
# SDAG_MODULE_DIR: where tools/ installs modules, below the prefix.
set(SDAG_MODULE_DIR ${CMAKE_INSTALL_LIBDIR}/shadowdag)
function(sdag_load_modules target)
  foreach(library sdag_vdb sdag_tools sdag_window)
    if(library IN_LIST ARGN)
      add_dependencies(${target} sdag_openvdb)
      target_link_options(${target} PRIVATE LINKER:--disable-new-dtags)
      file(RELATIVE_PATH modules ${CMAKE_CURRENT_BINARY_DIR} ${SDAG_MODULE_BUILD_DIR})
      set_target_properties(${target} PROPERTIES BUILD_RPATH $ORIGIN/${modules})
      return()
    endif()
  endforeach()
endfunction()

# sdag_add_cuda_sources(target a_cuda.cu ...) adds CUDA sources; does nothing without CUDA.
function(sdag_add_cuda_sources target)
  if(SDAG_CUDA_HOST)
    # As nvcc sees them in its pass for a device, by a compiler that knows nothing of CUDA.
    foreach(source ${ARGN})
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
      target_sources(${target} PRIVATE ${source})
      set_source_files_properties(${source} TARGET_DIRECTORY ${target} PROPERTIES
        LANGUAGE CXX
        SKIP_UNITY_BUILD_INCLUSION ON
        INCLUDE_DIRECTORIES ${PROJECT_SOURCE_DIR}/tests/cuda/host/include
        COMPILE_DEFINITIONS "__CUDACC__=1;__CUDA_ARCH__=750;SDAG_CUDA_HOST=1"
        COMPILE_OPTIONS "-include;cuda_runtime.h")
    endforeach()
  elseif(SDAG_WITH_CUDA)
    target_sources(${target} PRIVATE ${ARGN})
    target_link_libraries(${target} PRIVATE CUDA::cudart_static)
  endif()
endfunction()

# sdag_add_passes(target passes.cpp) adds a file that registers passes (cuda/pass_launch.h): as C++ for the CPU, and,
# where CUDA is on, once more through a .cu file of the build folder that includes it.
function(sdag_add_passes target file)
  target_sources(${target} PRIVATE ${file})
  if(SDAG_WITH_CUDA)
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    string(REGEX REPLACE "\\.cpp$" ".cu" name ${file})
    file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name} CONTENT "#include \"${path}\"\n")
    sdag_add_cuda_sources(${target} ${CMAKE_CURRENT_BINARY_DIR}/${name})
  endif()
endfunction()

# sdag_add_test(name a_test.cpp ... LIBS sdag_voxel ... [TIMEOUT seconds] [PROCESSORS n] [LABEL label] [UNITE])
# adds a GoogleTest binary, each of its tests a test of ctest. gtest_main is linked. A GTEST_SKIP is reported as skipped
# in ctest's summary. PROCESSORS: the number of ctest's jobs that a test takes, for tests that measure. LABEL, one per
# test: unit (the default), program (starts the program), gl (draws by OpenGL), slow (renders for seconds). `./do test
# --quick` runs the tests with label unit. CUDA: the files that have tests of CUDA, whose names contain "cuda" or
# "Cuda"; where the host plays the device, these are all that is built and run. UNITE: with SDAG_UNITY the sources between
# two "|" are compiled together; those that share the names of their helpers, or define macros, stand in different groups.
function(sdag_add_test name)
  if(NOT SDAG_TESTS)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "UNITE" "TIMEOUT;PROCESSORS;LABEL" "LIBS;CUDA")
  set(filter)
  if(SDAG_CUDA_HOST)
    if(NOT arg_CUDA)
      return()
    endif()
    set(arg_UNPARSED_ARGUMENTS ${arg_CUDA})
    set(filter TEST_FILTER "*cuda*:*Cuda*")
  endif()
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_LABEL MATCHES "^(unit|program|gl|slow)$")
    message(FATAL_ERROR "${name} is labelled '${arg_LABEL}'; the labels are unit, program, gl and slow")
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  if(CMAKE_CROSSCOMPILING_EMULATOR)
    math(EXPR arg_TIMEOUT "20 * ${arg_TIMEOUT}")
  endif()
  if(NOT arg_PROCESSORS)
    set(arg_PROCESSORS 1)
  endif()
  include(GoogleTest)
  set(sources ${arg_UNPARSED_ARGUMENTS})
  list(REMOVE_ITEM sources "|")
  add_executable(${name} ${sources})
  if(SDAG_UNITY AND arg_UNITE AND NOT SDAG_CUDA_HOST)
    sdag_unite_groups(${name} ${arg_UNPARSED_ARGUMENTS})
  endif()
  target_link_libraries(${name} PRIVATE sdag_flags ${arg_LIBS} GTest::gtest GTest::gmock GTest::gtest_main)
  # Tests do little work themselves: compiling them with little optimization takes a third less time. Those of tools/ do
  # least and are the longest to compile; with -Og the loops of others take five times as long.
  set(optimization -O1)
  if(sdag_tools IN_LIST arg_LIBS OR sdag_window IN_LIST arg_LIBS)
    set(optimization -Og)
  endif()
  target_compile_options(${name} PRIVATE $<$<AND:$<CONFIG:Release>,$<COMPILE_LANGUAGE:CXX>>:${optimization}>)
  target_compile_definitions(${name} PRIVATE SDAG_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  sdag_load_modules(${name} ${arg_LIBS})
  # ctest starts what costs most first, so that no long test runs alone at the end. It knows the times of a build folder
  # where it ran before; a new one has these.
  set(cost_unit 1)
  set(cost_gl 2)
  set(cost_program 5)
  set(cost_slow 10)
  gtest_discover_tests(${name} ${filter} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
                       PROPERTIES TIMEOUT ${arg_TIMEOUT} PROCESSORS ${arg_PROCESSORS} LABELS ${arg_LABEL}
                                  COST ${cost_${arg_LABEL}})
endfunction()

# sdag_add_bench(name a_bench.cpp ... LIBS sdag_voxel ...) adds a benchmark binary; not run by ctest.
function(sdag_add_bench name)
  if(NOT SDAG_BENCHES)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LIBS")
  add_executable(${name} ${arg_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE sdag_flags ${arg_LIBS})
  target_compile_definitions(${name} PRIVATE SDAG_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  sdag_load_modules(${name} ${arg_LIBS})
endfunction()

# Compiles NAME_avx2.cpp and NAME_avx512.cpp of a target for their processors: ray streams choose their instructions at
# run time, whatever SDAG_MARCH is; voxel/dag_stream_work.h says how that stays safe. On other processors the two files
# are empty.
function(sdag_compile_streams target name)
  if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    return()
  endif()
  set(here TARGET_DIRECTORY ${target})
  set(path ${CMAKE_CURRENT_SOURCE_DIR}/${name})
  set_property(SOURCE ${path}.cpp ${here} APPEND PROPERTY COMPILE_DEFINITIONS SDAG_STREAM_X86=1)
  set_property(SOURCE ${path}_avx2.cpp ${here} APPEND PROPERTY COMPILE_OPTIONS -march=x86-64-v3)
  set_property(SOURCE ${path}_avx512.cpp ${here} APPEND PROPERTY COMPILE_OPTIONS -march=x86-64-v4)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC 12's own AVX-512 headers start from registers that hold nothing (GCC bug 105593).
    set_property(SOURCE ${path}_avx512.cpp ${here} APPEND PROPERTY COMPILE_OPTIONS -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
endfunction()
