# Half of a file's compile time goes into headers that hardly ever change. Two sets of them are
# compiled once: for what computes, and for tests, which also read GoogleTest. Only the standard
# library and third parties stand in here; every file still includes all that it needs, and the
# build by clang, which goes without, proves it.

set(ENFILADE_PRECOMPILED_HEADERS
  <Eigen/Core> <Eigen/Geometry>
  <algorithm> <array> <chrono> <cmath> <cstdint> <cstdio> <cstring> <deque> <filesystem> <fstream>
  <functional> <limits> <map> <memory> <mutex> <optional> <random> <set> <span> <sstream>
  <stdexcept> <string> <string_view> <thread> <tuple> <utility> <variant> <vector>)

# enfilade_precompiled(NAME HEADERS...): a target that does nothing but compile the headers.
function(enfilade_precompiled name)
  set(empty ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${empty} CONTENT "")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${empty})
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()

# All targets below `folder`, without benchmarks/: what the peers ask of the compiler is their own.
function(enfilade_targets_below folder into)
  get_directory_property(targets DIRECTORY ${folder} BUILDSYSTEM_TARGETS)
  get_directory_property(subfolders DIRECTORY ${folder} SUBDIRECTORIES)
  list(FILTER subfolders EXCLUDE REGEX "/benchmarks$")
  foreach(subfolder ${subfolders})
    enfilade_targets_below(${subfolder} below)
    list(APPEND targets ${below})
  endforeach()
  set(${into} ${targets} PARENT_SCOPE)
endfunction()

# Called last, when all targets are known.
function(enfilade_precompile_headers root)
  if(NOT ENFILADE_PRECOMPILE)
    return()
  endif()
  enfilade_targets_below(${root} targets)
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
  enfilade_precompiled(enfilade_precompiled_code ${ENFILADE_PRECOMPILED_HEADERS})
  if(ENFILADE_TESTS)
    find_package(GTest REQUIRED)
    enfilade_precompiled(enfilade_precompiled_tests ${ENFILADE_PRECOMPILED_HEADERS} <gtest/gtest.h>)
    target_link_libraries(enfilade_precompiled_tests PRIVATE GTest::gtest)
    target_compile_options(enfilade_precompiled_tests PRIVATE ${ENFILADE_UNHURRIED})
  endif()
  set(unhurried "")
  if(ENFILADE_UNHURRIED)
    set(unhurried enfilade_import enfilade_server)  # their flags are those of tests
  endif()
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "UTILITY" OR target STREQUAL "enfilade_messages")
      continue()  # nothing to compile, or nothing that would read these headers
    elseif(NOT ENFILADE_TESTS AND target IN_LIST unhurried)
      continue()
    elseif(target MATCHES "_tests$" OR target IN_LIST unhurried)
      target_precompile_headers(${target} REUSE_FROM enfilade_precompiled_tests)
    else()
      target_precompile_headers(${target} REUSE_FROM enfilade_precompiled_code)
    endif()
  endforeach()
endfunction()
