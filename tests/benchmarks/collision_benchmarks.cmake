# Benchmarks of the collision core against its peers: built only by `./dev bench collision`. A peer
# that is not installed is skipped with a message.
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
find_library(BENCH_BULLET_FLOAT_COLLISION BulletCollision)
find_library(BENCH_BULLET_FLOAT_MATH LinearMath)
bench_peer(bulletfloat "${BENCH_BULLET_FLOAT_COLLISION}"
  DEFINITIONS BENCH_BULLET_FLOAT_MODULE="$<TARGET_FILE:bullet_float_pairs>"
  LIBRARIES ${CMAKE_DL_LIBS})
if(TARGET bench_bulletfloat)
  add_library(bullet_float_pairs MODULE EXCLUDE_FROM_ALL peers/bullet_pairs.cpp)
  set_target_properties(bullet_float_pairs PROPERTIES CXX_VISIBILITY_PRESET hidden)
  target_include_directories(bullet_float_pairs PRIVATE ${PROJECT_SOURCE_DIR})
  target_include_directories(bullet_float_pairs SYSTEM PRIVATE ${BENCH_BULLET_DIR})
  target_link_libraries(bullet_float_pairs PRIVATE enfilade_collision
    ${BENCH_BULLET_FLOAT_COLLISION} ${BENCH_BULLET_FLOAT_MATH})
  target_link_options(bullet_float_pairs PRIVATE -Wl,-Bsymbolic -Wl,--exclude-libs,ALL)
endif()
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

# Each peer's source is compiled with that peer's flags only; the table of methods knows the
# available peers.
# bench_methods(NAME SUFFIX SOURCES..): a library of peers/PEER_SUFFIX.cpp and SOURCES; the first of
# these is the table.
function(bench_methods name suffix table)
  add_library(${name} STATIC EXCLUDE_FROM_ALL ${table} ${ARGN})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC enfilade_collision nlohmann_json::nlohmann_json)
  foreach(peer ${ENFILADE_PEERS})
    set(source ${CMAKE_CURRENT_SOURCE_DIR}/peers/${peer}_${suffix}.cpp)
    if(EXISTS ${source})
      add_library(${name}_${peer} OBJECT EXCLUDE_FROM_ALL ${source})
      target_include_directories(${name}_${peer} PRIVATE ${PROJECT_SOURCE_DIR})
      target_link_libraries(${name}_${peer} PRIVATE enfilade_collision bench_${peer})
      target_sources(${name} PRIVATE $<TARGET_OBJECTS:${name}_${peer}>)
      target_link_libraries(${name} PUBLIC
        $<TARGET_PROPERTY:bench_${peer},INTERFACE_LINK_LIBRARIES>)
      string(TOUPPER BENCH_${peer} definition)
      set_property(SOURCE ${table} APPEND PROPERTY COMPILE_DEFINITIONS ${definition})
    endif()
  endforeach()
endfunction()

bench_methods(bench_broad_phases pairs broad_phase_methods.cpp
  approaches/brute_force.cpp approaches/bsp_tree.cpp approaches/hash_grid.cpp
  approaches/interval_tree.cpp approaches/loose_octree.cpp)
target_sources(bench_broad_phases PRIVATE broad_phase_runs.cpp)
if(TARGET bullet_float_pairs)
  add_dependencies(bench_broad_phases bullet_float_pairs)
endif()
bench_methods(bench_narrow_phases convex narrow_phase_methods.cpp our_narrow_phases.cpp)
bench_methods(bench_mesh_queries mesh mesh_methods.cpp our_mesh_queries.cpp)
bench_methods(bench_boxes boxes box_methods.cpp)

enfilade_benchmark(collision_broad_phase
  SOURCES collision_broad_phase.cpp building_workload.cpp
  LIBRARIES bench_broad_phases)
enfilade_benchmark(collision_all_moving
  SOURCES collision_all_moving.cpp moving_cubes.cpp
  LIBRARIES bench_broad_phases)
set(accuracy ${PROJECT_SOURCE_DIR}/tests/accuracy)
enfilade_benchmark(collision_narrow_phase
  SOURCES collision_narrow_phase.cpp convex_motions.cpp guarded_run.cpp ${accuracy}/case_file.cpp
          ${accuracy}/exact_geometry.cpp
  LIBRARIES bench_narrow_phases gmpxx gmp)
enfilade_benchmark(collision_mesh
  SOURCES collision_mesh.cpp
  LIBRARIES bench_mesh_queries)
enfilade_benchmark(collision_icollide
  SOURCES collision_icollide.cpp
  LIBRARIES bench_broad_phases bench_narrow_phases)
enfilade_benchmark(collision_time_to_contact
  SOURCES collision_time_to_contact.cpp building_workload.cpp
  LIBRARIES enfilade_collision nlohmann_json::nlohmann_json)
enfilade_benchmark(collision_boxes
  SOURCES collision_boxes.cpp
  LIBRARIES bench_boxes gmpxx gmp)
set(programs collision_all_moving collision_boxes collision_broad_phase collision_narrow_phase collision_mesh collision_icollide
  collision_time_to_contact)
set_target_properties(${programs} PROPERTIES EXCLUDE_FROM_ALL ON)
add_custom_target(collision_benchmarks DEPENDS ${programs})

# The parts feeder and the two peers that simulate it; built by `./dev bench feeder`.
find_library(BENCH_BULLET_DYNAMICS BulletDynamics-float64)
enfilade_benchmark(parts_feeder
  SOURCES parts_feeder.cpp ../support/parts_feeder.cpp
  LIBRARIES enfilade_assets enfilade_import)
set_target_properties(parts_feeder PROPERTIES EXCLUDE_FROM_ALL ON)
foreach(peer bullet ode)
  if(NOT TARGET bench_${peer} OR (peer STREQUAL bullet AND NOT BENCH_BULLET_DYNAMICS))
    continue()
  endif()
  add_library(feeder_${peer} OBJECT EXCLUDE_FROM_ALL peers/${peer}_feeder.cpp)
  target_include_directories(feeder_${peer} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(feeder_${peer} PRIVATE enfilade_scene bench_${peer})
  string(TOUPPER BENCH_${peer} definition)
  target_compile_definitions(parts_feeder PRIVATE ${definition})
  target_sources(parts_feeder PRIVATE $<TARGET_OBJECTS:feeder_${peer}>)
  if(peer STREQUAL bullet)
    target_link_libraries(parts_feeder PRIVATE ${BENCH_BULLET_DYNAMICS})
  endif()
  target_link_libraries(parts_feeder PRIVATE
    $<TARGET_PROPERTY:bench_${peer},INTERFACE_LINK_LIBRARIES>)
endforeach()
