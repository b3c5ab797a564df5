# SPDX-License-Identifier: Apache-2.0
# Decides whether scenes of other kinds than glTF are read, by Assimp; sets SDAG_WITH_ASSIMP and gives PkgConfig::assimp.
# A missing Assimp is an error only if it was requested.
set(SDAG_WITH_ASSIMP OFF)
if(NOT SDAG_ASSIMP MATCHES "^(AUTO|ON|OFF)$")
  message(FATAL_ERROR "SDAG_ASSIMP is '${SDAG_ASSIMP}'; it must be AUTO, ON or OFF")
endif()
if(NOT SDAG_ASSIMP STREQUAL "OFF")
  pkg_check_modules(assimp QUIET IMPORTED_TARGET GLOBAL assimp>=5.2)   # PkgConfig::assimp
  if(assimp_FOUND)
    set(SDAG_WITH_ASSIMP ON)
  elseif(SDAG_ASSIMP STREQUAL "ON")
    message(FATAL_ERROR "SDAG_ASSIMP=ON, but pkg-config finds no assimp of 5.2 or newer; install libassimp-dev, or set "
            "SDAG_ASSIMP=OFF")
  endif()
endif()
message(STATUS "ShadowDAG: other scenes than glTF ${SDAG_WITH_ASSIMP} (SDAG_ASSIMP=${SDAG_ASSIMP}): Assimp ${assimp_VERSION}")
