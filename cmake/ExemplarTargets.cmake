# The headers that most of our sources include, precompiled once: a sixth less compile time. Presets turn it
# on; the clang preset leaves it off, so that a missing include is still found.
option(EXEMPLAR_PRECOMPILE "Precompile the common headers of libraries and programs" OFF)
function(exemplar_use_common_headers name)
  if(NOT EXEMPLAR_PRECOMPILE)
    return()
  endif()
  if(NOT TARGET exemplar_common_headers)
    file(WRITE "${CMAKE_BINARY_DIR}/common_headers.cpp" "")
    add_library(exemplar_common_headers STATIC "${CMAKE_BINARY_DIR}/common_headers.cpp")
    target_link_libraries(exemplar_common_headers PRIVATE Eigen3::Eigen exemplar_warnings)
    target_precompile_headers(exemplar_common_headers PRIVATE
      <Eigen/Core> <Eigen/Geometry> <algorithm> <cmath> <functional> <map> <memory> <optional> <span>
      <string> <vector>)
  endif()
  target_precompile_headers(${name} REUSE_FROM exemplar_common_headers)
endfunction()

# exemplar_library(NAME SOURCES a.cpp ... [DEPS exemplar::base ...] [PRIVATE_DEPS ...])
#   A library of services/lib: headers in include/, target exemplar_NAME, alias exemplar::NAME.
function(exemplar_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  if(ARG_SOURCES)
    add_library(exemplar_${name} STATIC ${ARG_SOURCES})
    target_include_directories(exemplar_${name} PUBLIC "${CMAKE_CURRENT_SOURCE_DIR}/include"
                                                PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/src")
    target_link_libraries(exemplar_${name} PUBLIC ${ARG_DEPS}
                                           PRIVATE ${ARG_PRIVATE_DEPS} exemplar_warnings)
    exemplar_use_common_headers(exemplar_${name})
  else()
    add_library(exemplar_${name} INTERFACE)
    target_include_directories(exemplar_${name} INTERFACE "${CMAKE_CURRENT_SOURCE_DIR}/include")
    target_link_libraries(exemplar_${name} INTERFACE ${ARG_DEPS})
  endif()
  add_library(exemplar::${name} ALIAS exemplar_${name})
endfunction()

# exemplar_app(NAME SOURCES ... DEPS ...): the behaviour of a program, as a library without DDS or
#   gRPC; its headers are included as "NAME/x.hpp" (from services/).
function(exemplar_app name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  add_library(${name}_app STATIC ${ARG_SOURCES})
  target_include_directories(${name}_app PUBLIC "${CMAKE_SOURCE_DIR}/services")
  target_link_libraries(${name}_app PUBLIC ${ARG_DEPS} PRIVATE ${ARG_PRIVATE_DEPS} exemplar_warnings)
  exemplar_use_common_headers(${name}_app)
endfunction()

# exemplar_program(exemplar-NAME SOURCES main.cpp DEPS ...): a program in build/<preset>/bin. It is installed
#   unless it belongs to the tests.
function(exemplar_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} exemplar_warnings)
  set_property(GLOBAL APPEND PROPERTY EXEMPLAR_PROGRAMS ${name})
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${CMAKE_SOURCE_DIR}" OUTPUT_VARIABLE folder)
  if(folder MATCHES "^clients/")
    install(TARGETS ${name} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT clients)
  elseif(NOT folder MATCHES "^tests/")
    install(TARGETS ${name} RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime-services)
  endif()
endfunction()

# Every test includes GoogleTest, and most include Eigen: precompiled once they save a third of the tests'
# compile time. The owner is an executable because -fPIE and -fPIC must agree.
function(exemplar_use_test_headers name)
  if(NOT TARGET exemplar_test_headers)
    file(WRITE "${CMAKE_BINARY_DIR}/test_headers.cpp" "int main() {}\n")
    add_executable(exemplar_test_headers "${CMAKE_BINARY_DIR}/test_headers.cpp")
    target_link_libraries(exemplar_test_headers PRIVATE Eigen3::Eigen GTest::gmock exemplar_warnings)
    target_precompile_headers(exemplar_test_headers PRIVATE
      <gmock/gmock.h> <gtest/gtest.h> <Eigen/Core> <Eigen/Geometry> <map> <memory> <string> <vector>)
  endif()
  target_precompile_headers(${name} REUSE_FROM exemplar_test_headers)
endfunction()

# exemplar_test(NAME SOURCES ... DEPS ... [LABELS unit] [TIMEOUT seconds]): a GoogleTest binary,
#   each of its tests known to ctest by name.
function(exemplar_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;DEPS;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 60)
  endif()
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} GTest::gmock GTest::gtest_main exemplar_warnings)
  exemplar_use_test_headers(${name})
  target_compile_definitions(${name} PRIVATE
    EXEMPLAR_SOURCE_DIR="${CMAKE_SOURCE_DIR}" EXEMPLAR_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(${name} NO_PRETTY_VALUES DISCOVERY_MODE PRE_TEST TEST_PREFIX "${name}."
    DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}")
endfunction()
