# SPDX-License-Identifier: Apache-2.0
# cmake --install: the libraries with their headers, the experiments and studies, and the package config with which
# find_package(ShadowDAG) gives ShadowDAG::sdag_hybrid and the libraries before it; examples/shadow_rays uses it.
# tools/ installs the program.
include(CMakePackageConfigHelpers)
set(configFolder ${CMAKE_INSTALL_LIBDIR}/cmake/ShadowDAG)

set(installed sdag_flags)
foreach(folder ${SDAG_FOLDERS})
  if(TARGET sdag_${folder} AND NOT folder STREQUAL "tools")
    list(APPEND installed sdag_${folder})
    install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/shadowdag FILES_MATCHING PATTERN "*.h")
  endif()
endforeach()
install(TARGETS ${installed} EXPORT ShadowDAGTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT ShadowDAGTargets NAMESPACE ShadowDAG:: DESTINATION ${configFolder})
foreach(folder experiments studies)
  if(EXISTS ${PROJECT_SOURCE_DIR}/scenes/${folder})
    install(DIRECTORY scenes/${folder} DESTINATION ${CMAKE_INSTALL_DATADIR}/shadowdag)
  endif()
endforeach()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(cmake/ShadowDAGConfig.cmake.in ${PROJECT_BINARY_DIR}/ShadowDAGConfig.cmake
                              INSTALL_DESTINATION ${configFolder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/ShadowDAGConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ShadowDAGConfig.cmake ${PROJECT_BINARY_DIR}/ShadowDAGConfigVersion.cmake
              cmake/ShadowDagPackages.cmake DESTINATION ${configFolder})
