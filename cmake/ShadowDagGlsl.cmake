# SPDX-License-Identifier: Apache-2.0
# sdag_embed_glsl(sdag_voxel voxelGlsl dag_trace.glsl ...) puts the folder's GLSL files into the library, as the
# function shadowdag::voxelGlsl() (gl/glsl.h) that the folder declares.
# Run as a script (cmake -P), it writes that function's source; the files are read when the program is built.
if(CMAKE_SCRIPT_MODE_FILE)
  set(entries "")
  string(REPLACE "," ";" paths "${PATHS}")
  foreach(path ${paths})
    file(READ ${SOURCE_DIR}/${path} text)
    string(APPEND entries "        {\"${path}\", R\"glsl(${text})glsl\"},\n")
  endforeach()
  file(WRITE ${OUTPUT} "// Written by cmake/ShadowDagGlsl.cmake.\n#include \"gl/glsl.h\"\n\nnamespace shadowdag {\n\n"
       "GlslTexts ${FUNCTION}();\n\nGlslTexts ${FUNCTION}() {\n    return {\n${entries}    };\n}\n\n} // namespace shadowdag\n")
  return()
endif()

set(SDAG_GLSL_SCRIPT ${CMAKE_CURRENT_LIST_FILE})

function(sdag_embed_glsl target function)
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(paths "")
  set(files "")
  foreach(name ${ARGN})
    list(APPEND paths ${folder}/${name})
    list(APPEND files ${CMAKE_CURRENT_SOURCE_DIR}/${name})
  endforeach()
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  list(JOIN paths "," joined) # semicolons would not stay one argument
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DPATHS=${joined} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DFUNCTION=${function}
            -DOUTPUT=${output} -P ${SDAG_GLSL_SCRIPT}
    DEPENDS ${files} ${SDAG_GLSL_SCRIPT} COMMENT "GLSL texts of ${folder}" VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
