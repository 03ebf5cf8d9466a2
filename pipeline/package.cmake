# SPDX-License-Identifier: AGPL-3.0-or-later
# cpack -G DEB (make package): supine, all that runs cases; python3-supine; supine-dev, all that find_package(supine) needs.
set(supine_share ${CMAKE_INSTALL_DATADIR}/supine)
set(supine_all_tools)
foreach(command ${supine_commands} ${supine_plain_tools})
  if(TARGET supine-${command})
    list(APPEND supine_all_tools $<TARGET_FILE:supine-${command}>)
  endif()
endforeach()

# What drives the tools, beside them.
install(PROGRAMS pipeline/package/supine DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
install(FILES pipeline/Makefile pipeline/case_files.awk pipeline/case_part.awk pipeline/paraview_case.py pipeline/compare_displacements.py
        DESTINATION ${supine_share}/pipeline COMPONENT tools)
install(PROGRAMS pipeline/summary.sh DESTINATION ${supine_share}/pipeline COMPONENT tools)
install(DIRECTORY cohort DESTINATION ${supine_share} COMPONENT tools USE_SOURCE_PERMISSIONS PATTERN CMakeLists.txt EXCLUDE
        PATTERN "*.cpp*" EXCLUDE PATTERN "*.h" EXCLUDE PATTERN web EXCLUDE PATTERN __pycache__ EXCLUDE)
install(DIRECTORY samples DESTINATION ${supine_share} COMPONENT tools PATTERN out EXCLUDE)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/supine COMPONENT tools PATTERN "*.jsonl" EXCLUDE)
install(FILES LICENSE CHANGELOG.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/supine COMPONENT tools)

# One file of completions; bash looks for it by the command's name.
install(FILES pipeline/package/completion.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME supine COMPONENT tools)
foreach(command ${supine_commands} ${supine_plain_tools})
  install(CODE "file(CREATE_LINK supine \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/bash-completion/completions/supine-${command}\" SYMBOLIC)"
          COMPONENT tools)
endforeach()

# Only a package has man pages: they need help2man.
add_custom_target(man_pages
  COMMAND ${CMAKE_COMMAND} -E env SUPINE_BIN=${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_SOURCE_DIR}/pipeline/package/man_pages.sh ${PROJECT_BINARY_DIR}/man ${PROJECT_SOURCE_DIR}/pipeline/package/supine ${supine_all_tools}
  COMMENT "Man pages" VERBATIM)
add_dependencies(man_pages tools)
install(DIRECTORY ${PROJECT_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools OPTIONAL FILES_MATCHING PATTERN "*.gz")

set(CPACK_PACKAGE_NAME supine)
set(CPACK_PACKAGE_VENDOR "Supine developers")
set(CPACK_PACKAGE_CONTACT "Supine developers <supine@example.org>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL tools python dev)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
# Libraries as dpkg-shlibdeps finds them; beside them what the Makefile and the pictures call.
set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME supine)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "bash, make, jq, mawk | gawk, python3, xvfb, libgl1-mesa-dri, libopenblas0-pthread")
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "snakemake, supine-dev, paraview")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "prone breast MRI to supine shape, and which effect a model lacks
 Takes a prone breast MRI to the shape of the breast on the operating table,
 compares that prediction with a measured surface, and says which physical
 effect the model lacks. Research software, not a medical device.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-supine)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${supine_python_version}), python3 (<< ${supine_python_next}), python3-numpy, libopenblas0-pthread")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "supine, python3-vtk9, python3-matplotlib")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "supine for Python: prone breast MRI to supine shape
 import supine: cases, models, predictions, calibration and diagnosis of supine,
 with NumPy arrays.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME supine-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "supine (= ${PROJECT_VERSION}-1), cmake, g++, ninja-build | make, libeigen3-dev, libsuitesparse-dev, \
libopenblas-pthread-dev, libvtk9-dev, libcgal-dev, libtet1.5-dev, libopenmesh-dev, libceres-dev, libpagmo-dev, libteem-dev, libgdcm-dev, \
libboost-dev, zlib1g-dev, libcli11-dev, libtomlplusplus-dev, nlohmann-json3-dev, libspdlog-dev, libfmt-dev, libssl-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "libraries of supine, for effects and programs of your own
 Static libraries, headers and find_package(supine) of supine.")
include(CPack)
