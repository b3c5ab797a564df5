# SPDX-License-Identifier: Apache-2.0
# Run by CPack over the installed files, before it packs them: moves the Python package to where Debian's Python looks
# for packages of Debian, compresses the man page, and adds the documentation site.
set(usr ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/usr)
if(NOT EXISTS ${CPACK_SDAG_SITE}/index.html)
  message(FATAL_ERROR "the package holds the documentation, and ${CPACK_SDAG_SITE} has none; run ./do docs first")
endif()
file(COPY ${CPACK_SDAG_SITE} DESTINATION ${usr}/${CPACK_SDAG_DOCDIR})
if(CPACK_SDAG_PYTHON_DIR)
  file(MAKE_DIRECTORY ${usr}/lib/python3)
  file(RENAME ${usr}/${CPACK_SDAG_PYTHON_DIR} ${usr}/lib/python3/dist-packages)
  cmake_path(GET CPACK_SDAG_PYTHON_DIR PARENT_PATH emptied)
  file(REMOVE_RECURSE ${usr}/${emptied})
endif()
execute_process(COMMAND gzip -9n ${usr}/share/man/man1/shadowdag.1 COMMAND_ERROR_IS_FATAL ANY)
