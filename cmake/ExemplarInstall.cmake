# What `cmake --install BUILD --prefix P [--component C]` puts where. Programs are installed by
# exemplar_program; here stands what is no target. Components:
#   runtime-services   the services with robots, scenes and the topics' types
#   clients            the command line with its completions
#   development        the C++ client library, headers, the gRPC API
set(EXEMPLAR_SHARE "${CMAKE_INSTALL_DATADIR}/exemplar")
foreach(folder deploy/models deploy/config deploy/dds)
  if(EXISTS "${CMAKE_SOURCE_DIR}/${folder}")
    install(DIRECTORY "${CMAKE_SOURCE_DIR}/${folder}" DESTINATION "${EXEMPLAR_SHARE}" COMPONENT runtime-services)
  endif()
endforeach()
# The web page, where deploy/build could make it.
install(DIRECTORY "${CMAKE_SOURCE_DIR}/build/web/" DESTINATION "${EXEMPLAR_SHARE}/web" COMPONENT runtime-services OPTIONAL)
install(DIRECTORY "${CMAKE_SOURCE_DIR}/idl" DESTINATION "${EXEMPLAR_SHARE}" COMPONENT runtime-services
  FILES_MATCHING PATTERN "*.idl" PATTERN include EXCLUDE)
install(DIRECTORY "${CMAKE_SOURCE_DIR}/proto" DESTINATION "${EXEMPLAR_SHARE}" COMPONENT development
  FILES_MATCHING PATTERN "*.proto")
foreach(component runtime-services clients development)
  set(folder exemplar-${component})
  if(component STREQUAL "runtime-services")
    set(folder exemplar-services)
  elseif(component STREQUAL "development")
    set(folder libexemplar-dev)
  endif()
  install(FILES "${CMAKE_SOURCE_DIR}/LICENSE" "${CMAKE_SOURCE_DIR}/CHANGELOG.md"
    DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/${folder}" COMPONENT ${component})
endforeach()

include(ExemplarPackages)
