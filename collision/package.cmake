# Installs the collision library alone: `cmake --install BUILD --prefix P --component collision`.
# find_package(enfilade_collision) then provides the target enfilade::collision.
# Headers that are not listed are internal. A listed header may include listed headers only.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(public_headers
  bounds/bounding_box.hpp
  broad_phase/broad_phase_audit.hpp
  broad_phase/sort_and_sweep.hpp
  broad_phase/sweep_result.hpp
  compound/compound_view.hpp
  compound/nearest_parts.hpp
  compound/overlapping_parts.hpp
  minkowski/feature_cache.hpp
  minkowski/verdict.hpp
  motion/interpolated_motion.hpp
  motion/motion_result.hpp
  motion/moving_pose.hpp
  motion/pair_schedule.hpp
  motion/rigid_motion.hpp
  motion/shape_cast.hpp
  motion/time_of_impact.hpp
  motion/time_to_contact.hpp
  narrow_phase/contact_manifold.hpp
  narrow_phase/feature.hpp
  narrow_phase/narrow_phase.hpp
  narrow_phase/penetration_depth.hpp
  narrow_phase/refine.hpp
  shapes/box_tree.hpp
  shapes/hull.hpp
  shapes/placed_convex.hpp
  shapes/triangle_tree.hpp
  types.hpp)
target_sources(enfilade_collision PUBLIC
  FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${public_headers})
target_compile_features(enfilade_collision PUBLIC cxx_std_20)
set_target_properties(enfilade_collision PROPERTIES EXPORT_NAME collision)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/enfilade_collision)
install(TARGETS enfilade_collision EXPORT enfilade_collision_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT collision
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/enfilade COMPONENT collision)
install(EXPORT enfilade_collision_targets NAMESPACE enfilade:: DESTINATION ${package_dir}
  COMPONENT collision)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/enfilade_collisionConfigVersion.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES enfilade_collisionConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/enfilade_collisionConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT collision)
