# Precompiles the headers of the standard library and of third parties, which take half of a file's
# compile time. There are five sets: collision and physics; computation; code with messages (protobuf,
# JSON); and the last two with GoogleTest. gcc takes the level of optimisation from the precompiled
# header, whatever the file's own options are, so each set has one.
# Each file still includes all its headers: the clang build does not precompile them.

set(ENFILADE_PRECOMPILED_HEADERS
  <Eigen/Core> <Eigen/Geometry>
  <algorithm> <array> <chrono> <cmath> <cstdint> <cstdio> <cstring> <deque> <filesystem> <fstream>
  <functional> <limits> <map> <memory> <mutex> <optional> <random> <set> <span> <sstream>
  <stdexcept> <string> <string_view> <thread> <tuple> <utility> <variant> <vector>)
set(ENFILADE_PRECOMPILED_MESSAGES
  <google/protobuf/generated_enum_reflection.h> <google/protobuf/generated_message_reflection.h>
  <google/protobuf/generated_message_util.h> <google/protobuf/message.h>
  <google/protobuf/repeated_field.h> <google/protobuf/unknown_field_set.h>
  <nlohmann/json.hpp> <protocol/enfilade.pb.h> <protocol/recording.pb.h>)

# enfilade_precompiled(NAME HEADERS... [LIBRARIES...]): a target that only compiles the headers.
function(enfilade_precompiled name)
  cmake_parse_arguments(P "" "" "HEADERS;LIBRARIES" ${ARGN})
  set(empty ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${empty} CONTENT "")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${empty})
  target_link_libraries(${name} PRIVATE Eigen3::Eigen ${P_LIBRARIES})
  if(P_HEADERS MATCHES "\\.pb\\.h")
    target_include_directories(${name} SYSTEM PRIVATE
      $<TARGET_PROPERTY:enfilade_messages,INTERFACE_INCLUDE_DIRECTORIES>)
    add_dependencies(${name} enfilade_message_headers)
  endif()
  target_precompile_headers(${name} PRIVATE ${ENFILADE_PRECOMPILED_HEADERS} ${P_HEADERS})
endfunction()

# All targets below `folder` except those of benchmarks/, whose flags depend on the peers.
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
  find_package(nlohmann_json REQUIRED)
  find_package(Protobuf REQUIRED)
  set(messages HEADERS ${ENFILADE_PRECOMPILED_MESSAGES}
               LIBRARIES protobuf::libprotobuf nlohmann_json::nlohmann_json)
  enfilade_precompiled(enfilade_precompiled_collision)
  target_compile_options(enfilade_precompiled_collision PRIVATE ${ENFILADE_HURRIED})
  enfilade_precompiled(enfilade_precompiled_code)
  enfilade_precompiled(enfilade_precompiled_messages ${messages})
  target_compile_options(enfilade_precompiled_messages PRIVATE ${ENFILADE_UNHURRIED})
  if(ENFILADE_TESTS)
    find_package(GTest REQUIRED)
    enfilade_precompiled(enfilade_precompiled_tests HEADERS <gtest/gtest.h> LIBRARIES GTest::gtest)
    enfilade_precompiled(enfilade_precompiled_message_tests
      HEADERS ${ENFILADE_PRECOMPILED_MESSAGES} <gtest/gtest.h>
      LIBRARIES protobuf::libprotobuf nlohmann_json::nlohmann_json GTest::gtest)
    target_compile_options(enfilade_precompiled_tests PRIVATE ${ENFILADE_UNHURRIED})
    target_compile_options(enfilade_precompiled_message_tests PRIVATE ${ENFILADE_UNHURRIED})
  endif()
  set(with_messages enfilade_server enfilade_protocol protocol_tests server_tests replay_tests
                    difference_tests export_tests
                    enfilade_import)  # no messages, but equal flags, which a precompiled header needs
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "UTILITY" OR target STREQUAL "enfilade_messages")
      continue()  # nothing to compile, or none of these headers
    endif()
    set(kind code)
    if(target MATCHES "^enfilade_(collision|physics)$")
      set(kind collision)
    elseif(target IN_LIST with_messages)
      set(kind messages)
    endif()
    if(target MATCHES "_tests$")
      string(REPLACE code tests kind ${kind})
      string(REPLACE messages message_tests kind ${kind})
    endif()
    target_precompile_headers(${target} REUSE_FROM enfilade_precompiled_${kind})
  endforeach()
endfunction()
