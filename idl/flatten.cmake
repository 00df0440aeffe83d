# Writes OUTPUT, a C++ file with the text of each IDL_DIR/<topic>.idl, includes inlined.
set(cases "")
foreach(topic ${TOPICS})
  file(READ "${IDL_DIR}/${topic}.idl" text)
  while(text MATCHES "#include \"([^\"]+)\"[^\n]*\n")
    set(line "${CMAKE_MATCH_0}")
    file(READ "${IDL_DIR}/${CMAKE_MATCH_1}" included)
    string(REPLACE "${line}" "${included}" text "${text}")
  endwhile()
  string(APPEND cases "  if (name == \"${topic}\") {\n    return R\"idl(${text})idl\";\n  }\n")
endforeach()
file(WRITE "${OUTPUT}"
  "#include \"ircp_schemas.hpp\"\n\nnamespace exemplar::idl {\n\n"
  "std::string_view FlattenedIdl(std::string_view name) {\n${cases}  return {};\n}\n\n"
  "}  // namespace exemplar::idl\n")
