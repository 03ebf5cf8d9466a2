# SPDX-License-Identifier: AGPL-3.0-or-later
# cmake --install: tools, what drives them, libraries, headers, and find_package(supine) for other projects
# (samples/own_effect).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(supine_libraries supine_options supine_common supine_vtk)
foreach(folder segmentation reconstruction meshing simulation calibration registration diagnosis warp pipeline picture)
  if(TARGET supine_${folder})
    list(APPEND supine_libraries supine_${folder})
  endif()
endforeach()
set(supine_commands simulate compare model calibrate sensitivity diagnose targets)
set(supine_plain_tools segment reconstruct decimate tetrahedralise phantom register warp report cohort)

install(TARGETS ${supine_libraries} EXPORT supine ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/supine COMPONENT dev)
install(EXPORT supine NAMESPACE supine:: FILE supineTargets.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/supine COMPONENT dev)
foreach(command ${supine_commands} ${supine_plain_tools})
  if(TARGET supine-${command})
    install(TARGETS supine-${command} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
  endif()
endforeach()
foreach(folder common segmentation reconstruction meshing simulation calibration registration diagnosis warp phantom pipeline)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/supine COMPONENT dev FILES_MATCHING PATTERN *.h)
endforeach()
# Tools that know the catalogue are built again by a project that adds to it.
foreach(command ${supine_commands})
  install(FILES ${PROJECT_SOURCE_DIR}/pipeline/commands/${command}.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/supine/commands COMPONENT dev)
endforeach()

list(JOIN supine_vtk_components " " supine_vtk_list)
configure_package_config_file(${PROJECT_SOURCE_DIR}/pipeline/supineConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/supineConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/supine
  PATH_VARS CMAKE_INSTALL_BINDIR CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/supineConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/supineConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/supineConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/supine COMPONENT dev)

# import supine.
if(TARGET _supine)
  set(supine_python_install lib/python3/dist-packages/supine)
  install(TARGETS _supine _settings LIBRARY DESTINATION ${supine_python_install} COMPONENT python)
  install(FILES ${supine_python_files} DESTINATION ${supine_python_install} COMPONENT python)
endif()

include(${CMAKE_CURRENT_LIST_DIR}/package.cmake)
