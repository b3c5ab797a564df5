# SPDX-License-Identifier: Apache-2.0
# sdag_flags: the compiler flags of all our files. sdag_cuda links it PUBLIC, so every folder has it.
add_library(sdag_flags INTERFACE)
add_library(ShadowDAG::sdag_flags ALIAS sdag_flags)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)

target_compile_features(sdag_flags INTERFACE cxx_std_20)
target_include_directories(sdag_flags INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/shadowdag>)

# -ffp-contract=off: no fused multiply-add, so every compiler and level gives the same bits; users of the headers
# need it as well. --fmad=false is its counterpart for kernels.
target_compile_options(sdag_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>
  $<$<COMPILE_LANGUAGE:CXX>:-march=${SDAG_MARCH}>
  $<$<COMPILE_LANGUAGE:CUDA>:--fmad=false>
  $<$<COMPILE_LANGUAGE:CUDA>:--expt-relaxed-constexpr>
  $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-ffp-contract=off>
  $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-march=${SDAG_MARCH}>)

# Warnings are for our own build only. -Wextra is not given to nvcc's host pass, because it warns about generated stubs.
# 20012: GLM's defaulted functions carry annotations that nvcc ignores.
target_compile_options(sdag_flags INTERFACE
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wall>>
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wextra>>
  $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall>>
  $<$<COMPILE_LANGUAGE:CUDA>:--diag-suppress=20012>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees overlapping memcpys in "literal" + std::string (GCC bug 105651).
  target_compile_options(sdag_flags INTERFACE $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wno-restrict>>)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # libstdc++ 12's own std::stable_sort uses a function that it deprecates.
  target_compile_options(sdag_flags INTERFACE $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Wno-deprecated-declarations>>)
endif()
if(SDAG_WERROR)
  target_compile_options(sdag_flags INTERFACE
    $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:-Werror>>
    $<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings>>)
endif()

if(SDAG_ASSERTIONS)
  target_compile_definitions(sdag_flags INTERFACE $<BUILD_INTERFACE:SDAG_ASSERTIONS=1>)
endif()

if(SDAG_WITH_CUDA)
  target_compile_definitions(sdag_flags INTERFACE SDAG_WITH_CUDA=1)
endif()

if(SDAG_SANITIZE STREQUAL "address")
  set(SDAG_SANITIZE_FLAGS -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
elseif(SDAG_SANITIZE STREQUAL "thread")
  if(SDAG_CPU_BACKEND STREQUAL "tbb")
    message(FATAL_ERROR "SDAG_SANITIZE=thread needs SDAG_CPU_BACKEND=threads: Debian's oneTBB is not "
            "instrumented and gives false reports")
  endif()
  set(SDAG_SANITIZE_FLAGS -fsanitize=thread -fno-omit-frame-pointer)
elseif(SDAG_SANITIZE STREQUAL "fuzzer")
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "SDAG_SANITIZE=fuzzer needs clang, whose libFuzzer it uses; use the preset fuzz")
  endif()
  # Of undefined behaviour what readers risk: all of it doubles the time to compile.
  set(SDAG_SANITIZE_FLAGS -fsanitize=fuzzer-no-link,address,signed-integer-overflow,shift,float-cast-overflow,bool,enum
      -fno-sanitize-recover=all -fno-omit-frame-pointer)
elseif(SDAG_SANITIZE)
  message(FATAL_ERROR "SDAG_SANITIZE is '${SDAG_SANITIZE}'; it must be empty, address, thread or fuzzer")
endif()
if(SDAG_SANITIZE)
  target_compile_definitions(sdag_flags INTERFACE $<BUILD_INTERFACE:SDAG_SANITIZED=1>)
  # A target with the property SDAG_UNSANITIZED keeps out; its own options would come first and be overruled.
  target_compile_options(sdag_flags INTERFACE
    "$<BUILD_INTERFACE:$<$<NOT:$<BOOL:$<TARGET_PROPERTY:SDAG_UNSANITIZED>>>:${SDAG_SANITIZE_FLAGS}>>")
  target_link_options(sdag_flags INTERFACE $<BUILD_INTERFACE:${SDAG_SANITIZE_FLAGS}>)
endif()
