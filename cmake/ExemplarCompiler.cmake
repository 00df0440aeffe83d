# Language, warnings, sanitizers, ccache and linker: one place for all targets.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# Release keeps assertions out of the way but never -march=native: the packaged FCL and Eigen's
# alignment were settled without it (see DECISIONS.md).
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG")
set(CMAKE_C_FLAGS_RELEASE "-O2 -DNDEBUG")

find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_C_COMPILER_LAUNCHER "${CCACHE}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CCACHE}")
endif()
find_program(LLD ld.lld)
if(LLD)
  add_link_options(-fuse-ld=lld)
endif()

set(EXEMPLAR_SANITIZE "" CACHE STRING "Comma-separated sanitizers, as -fsanitize takes them")
if(EXEMPLAR_SANITIZE)
  # ASan sees null dereferences itself; leaving these three out of UBSan halves the compile time.
  add_compile_options(-O1 -g1 -fno-omit-frame-pointer "-fsanitize=${EXEMPLAR_SANITIZE}")
  add_link_options("-fsanitize=${EXEMPLAR_SANITIZE}")
  if(EXEMPLAR_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize=null,alignment,vptr -fno-sanitize-recover=undefined)
  endif()
endif()

# Warnings are errors in our own code; generated code is compiled without them.
add_library(exemplar_warnings INTERFACE)
target_compile_options(exemplar_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wconversion
  -Wno-sign-conversion -Wimplicit-fallthrough -Wextra-semi -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 reports these inside Eigen, std::variant and std::string at -O2; none was ever true here.
  target_compile_options(exemplar_warnings INTERFACE -Wno-maybe-uninitialized -Wno-array-bounds
    -Wno-stringop-overflow -Wno-stringop-overread -Wno-restrict)
endif()
