# SPDX-License-Identifier: Apache-2.0
# Run by every build: writes OUTPUT (a header) when the commit, its dirtiness or the voxelizer's sources changed.
#   cmake -DSOURCE=<root> -DOUTPUT=<header> -DBUILD_TYPE=.. -DPRESET=.. -DCOMPILER=.. -DFLAGS=.. -P provenance.cmake
set(commit unknown)
find_program(git git)
if(git AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${git} -c safe.directory=* -C ${SOURCE} rev-parse --short=12 HEAD
                  OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit ${head})
    # Untracked files do not count: they are not part of the program.
    execute_process(COMMAND ${git} -c safe.directory=* -C ${SOURCE} status --porcelain --untracked-files=no
                    OUTPUT_VARIABLE changes ERROR_QUIET)
    if(changes)
      string(APPEND commit "+dirty")
    endif()
  endif()
endif()

file(GLOB sources ${SOURCE}/cuda/* ${SOURCE}/scenes/* ${SOURCE}/voxel/*)
list(SORT sources)
set(hashes "")
foreach(source IN LISTS sources)
  if(NOT IS_DIRECTORY ${source})
    file(SHA256 ${source} hash)
    string(APPEND hashes ${hash})
  endif()
endforeach()
string(SHA256 voxelHash "${hashes}")
string(SUBSTRING ${voxelHash} 0 16 voxelHash)

foreach(name commit BUILD_TYPE PRESET COMPILER FLAGS)
  string(REPLACE "\\" "\\\\" ${name} "${${name}}")
  string(REPLACE "\"" "\\\"" ${name} "${${name}}")
endforeach()
set(text "// Written by tools/settings/provenance.cmake on every build.
#define SDAG_COMMIT \"${commit}\"
#define SDAG_VOXEL_SOURCE_HASH \"${voxelHash}\"
#define SDAG_BUILD_TYPE \"${BUILD_TYPE}\"
#define SDAG_PRESET \"${PRESET}\"
#define SDAG_COMPILER \"${COMPILER}\"
#define SDAG_FLAGS \"${FLAGS}\"
")
set(old "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} old)
endif()
if(NOT old STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
