# The collision core beside its peers (`./dev bench collision`). A peer that is not installed is left
# out, with a message; none of them is needed for anything else.
find_package(PkgConfig QUIET)
find_package(nlohmann_json 3 REQUIRED)

set(ENFILADE_PEERS "")
# bench_peer(NAME FOUND [DEFINITIONS..] [INCLUDES..] [LIBRARIES..]): makes the target bench_NAME.
function(bench_peer name found)
  cmake_parse_arguments(P "" "" "DEFINITIONS;INCLUDES;LIBRARIES" ${ARGN})
  if(NOT found)
    message(STATUS "Benchmarks: ${name} is not installed and is left out")
    return()
  endif()
  string(TOUPPER ${name} upper)
  add_library(bench_${name} INTERFACE)
  target_compile_definitions(bench_${name} INTERFACE BENCH_${upper} ${P_DEFINITIONS})
  target_include_directories(bench_${name} SYSTEM INTERFACE ${P_INCLUDES})
  target_link_libraries(bench_${name} INTERFACE ${P_LIBRARIES})
  list(APPEND ENFILADE_PEERS ${name})
  set(ENFILADE_PEERS ${ENFILADE_PEERS} PARENT_SCOPE)
endfunction()

find_path(BENCH_BOOST_DIR boost/geometry/index/rtree.hpp)
bench_peer(boost "${BENCH_BOOST_DIR}" INCLUDES ${BENCH_BOOST_DIR})
find_path(BENCH_BULLET_DIR btBulletCollisionCommon.h PATH_SUFFIXES bullet)
find_library(BENCH_BULLET_COLLISION BulletCollision-float64)
find_library(BENCH_BULLET_MATH LinearMath-float64)
bench_peer(bullet "${BENCH_BULLET_COLLISION}" DEFINITIONS BT_USE_DOUBLE_PRECISION
  INCLUDES ${BENCH_BULLET_DIR} LIBRARIES ${BENCH_BULLET_COLLISION} ${BENCH_BULLET_MATH})
find_path(BENCH_FCL_DIR fcl/fcl.h)
find_library(BENCH_CCD_LIBRARY ccd)
find_library(BENCH_FCL_LIBRARY fcl)
bench_peer(fcl "${BENCH_FCL_DIR}" INCLUDES ${BENCH_FCL_DIR}
  LIBRARIES ${BENCH_FCL_LIBRARY} ${BENCH_CCD_LIBRARY})
find_path(BENCH_CCD_DIR ccd/ccd.h)
bench_peer(ccd "${BENCH_CCD_DIR}" INCLUDES ${BENCH_CCD_DIR} LIBRARIES ${BENCH_CCD_LIBRARY})
find_path(BENCH_ODE_DIR ode/ode.h)
find_library(BENCH_ODE_LIBRARY ode)
bench_peer(ode "${BENCH_ODE_DIR}" INCLUDES ${BENCH_ODE_DIR} LIBRARIES ${BENCH_ODE_LIBRARY})
find_path(BENCH_CGAL_DIR CGAL/box_intersection_d.h)
bench_peer(cgal "${BENCH_CGAL_DIR}" INCLUDES ${BENCH_CGAL_DIR} LIBRARIES gmp mpfr)
find_path(BENCH_EMBREE_DIR embree3/rtcore.h)
find_library(BENCH_EMBREE_LIBRARY embree3)
bench_peer(embree "${BENCH_EMBREE_DIR}" INCLUDES ${BENCH_EMBREE_DIR}
  LIBRARIES ${BENCH_EMBREE_LIBRARY})

# Each peer's part of a program, compiled with that peer's flags only; the tables of methods with
# all their definitions.
# bench_program(NAME TABLE SUFFIX SOURCES..): peers/PEER_SUFFIX.cpp where there is one.
function(bench_program name table suffix)
  set(libraries enfilade_collision nlohmann_json::nlohmann_json)
  set(definitions "")
  foreach(peer ${ENFILADE_PEERS})
    set(source ${CMAKE_CURRENT_SOURCE_DIR}/peers/${peer}_${suffix}.cpp)
    if(EXISTS ${source})
      add_library(${name}_${peer} OBJECT ${source})
      target_include_directories(${name}_${peer} PRIVATE ${PROJECT_SOURCE_DIR})
      target_link_libraries(${name}_${peer} PRIVATE enfilade_collision bench_${peer})
      string(TOUPPER ${peer} upper)
      list(APPEND definitions BENCH_${upper})
      list(APPEND libraries ${name}_${peer} $<TARGET_PROPERTY:bench_${peer},INTERFACE_LINK_LIBRARIES>)
    endif()
  endforeach()
  enfilade_benchmark(${name} SOURCES ${ARGN} ${table} LIBRARIES ${libraries})
  set_source_files_properties(${table} PROPERTIES COMPILE_DEFINITIONS "${definitions}")
  add_dependencies(collision_benchmarks ${name})
endfunction()

add_custom_target(collision_benchmarks)
bench_program(collision_broad_phase broad_phase_methods.cpp pairs
  collision_broad_phase.cpp building_workload.cpp approaches/brute_force.cpp
  approaches/bsp_tree.cpp approaches/hash_grid.cpp approaches/interval_tree.cpp
  approaches/loose_octree.cpp)

set(accuracy ${PROJECT_SOURCE_DIR}/tests/accuracy)
bench_program(collision_narrow_phase narrow_phase_methods.cpp convex
  collision_narrow_phase.cpp convex_motions.cpp guarded_run.cpp our_narrow_phases.cpp
  ${accuracy}/case_file.cpp ${accuracy}/exact_geometry.cpp)
target_link_libraries(collision_narrow_phase PRIVATE gmpxx gmp)
if(EXISTS ${PROJECT_SOURCE_DIR}/collision/refine.cpp)
  target_compile_definitions(collision_narrow_phase PRIVATE BENCH_REFINE)
endif()
