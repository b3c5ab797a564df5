# SPDX-License-Identifier: Apache-2.0
# Decides whether the CUDA passes are compiled, and by what; sets SDAG_WITH_CUDA, and SDAG_CUDA_HOST where the host's
# compiler compiles them, for a device that the host plays (tests/cuda/host). A missing nvcc is an error only if it was
# requested.
set(SDAG_WITH_CUDA OFF)
set(SDAG_CUDA_HOST OFF)
if(NOT SDAG_CUDA MATCHES "^(AUTO|ON|OFF|HOST)$")
  message(FATAL_ERROR "SDAG_CUDA is '${SDAG_CUDA}'; it must be AUTO, ON, OFF or HOST")
endif()
if(SDAG_SANITIZE AND SDAG_CUDA STREQUAL "ON")
  message(FATAL_ERROR "SDAG_SANITIZE=${SDAG_SANITIZE} and SDAG_CUDA=ON exclude each other: host sanitizers "
          "do not see kernels. Set SDAG_CUDA=OFF, or use compute-sanitizer on the cuda preset")
endif()
if(SDAG_CUDA STREQUAL "HOST")
  if(NOT SDAG_TESTS)
    message(FATAL_ERROR "SDAG_CUDA=HOST is for tests: a device that the host plays is of no other use. Set SDAG_TESTS=ON")
  endif()
  set(SDAG_WITH_CUDA ON)
  set(SDAG_CUDA_HOST ON)
elseif(NOT SDAG_CUDA STREQUAL "OFF" AND NOT SDAG_SANITIZE)
  include(CheckLanguage)
  check_language(CUDA)
  if(NOT CMAKE_CUDA_COMPILER AND EXISTS /usr/local/cuda/bin/nvcc)
    # NVIDIA's installer puts nvcc there, but not into the PATH.
    unset(CMAKE_CUDA_COMPILER CACHE)
    set(ENV{CUDACXX} /usr/local/cuda/bin/nvcc)
    check_language(CUDA)
  endif()
  if(CMAKE_CUDA_COMPILER)
    enable_language(CUDA)
    if(CMAKE_VERSION VERSION_LESS 3.26)
      # CMake 3.25 does not know that nvcc supports C++20.
      set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION "-std=c++20")
      set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION "-std=c++20")
    endif()
    set(CMAKE_CUDA_STANDARD 20)
    find_package(CUDAToolkit REQUIRED)
    set(SDAG_WITH_CUDA ON)
  elseif(SDAG_CUDA STREQUAL "ON")
    message(FATAL_ERROR "SDAG_CUDA=ON, but no nvcc was found. Install the CUDA toolkit (12 or newer), set "
            "CMAKE_CUDA_COMPILER to its nvcc, or set SDAG_CUDA=OFF")
  endif()
endif()
message(STATUS "ShadowDAG: CUDA passes ${SDAG_WITH_CUDA} (SDAG_CUDA=${SDAG_CUDA})")
