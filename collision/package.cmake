# The library alone: `cmake --install BUILD --prefix P --component collision` installs it with these
# headers and a package, so that find_package(enfilade_collision) gives enfilade::collision.
# Headers that are not listed are internal; a listed one may include listed ones only.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(public_headers
  bounding_box.hpp box_tree.hpp broad_phase_audit.hpp contact_manifold.hpp continuous.hpp
  continuous_pose.hpp hull.hpp hull_planes.hpp mesh_probe.hpp mesh_query.hpp narrow_phase.hpp
  nearest_parts.hpp
  part_tree.hpp penetration_depth.hpp refine.hpp sort_and_sweep.hpp time_of_impact.hpp turning_sweep.hpp
  triangle_tree.hpp types.hpp wake_up_heap.hpp)
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
