#include "scene/model/diagnostic_catalog.hpp"

#include <algorithm>
#include <array>

namespace enfilade::scene {
namespace {

constexpr bool kNote = true, kWrong = false;

constexpr std::array kKinds{
    // of the file
    ProblemKind{"cut_off_file", kWrong, "the file ends too early; copy or export it again"},
    ProblemKind{"damaged_statement", kWrong, "lines that are not STEP were left out"},
    ProblemKind{"ifc_reader_absent", kWrong,
                "a reader is not installed and another one read the file; ./dev installs all"},
    ProblemKind{"ifc_reader_failed", kWrong,
                "a reader gave up and another one read the file; --ifc-reader chooses one"},
    ProblemKind{"mended_text", kWrong, "the text was mended in memory; export it again"},
    ProblemKind{"missing_material_file", kWrong, "put the .mtl file beside the model"},
    ProblemKind{"no_unit", kWrong, "the file tells no unit; say it with --unit"},
    ProblemKind{"unit_assumed", kWrong, "the file's unit is doubtful; say it with --unit"},
    // of places
    ProblemKind{"broken_transform_dropped", kWrong,
                "placed by numbers that are none or beyond all bounds: left out"},
    ProblemKind{"coarse_coordinates", kWrong,
                "far from its own origin: its surface is known in coarse steps only"},
    ProblemKind{"coarse_placement", kWrong,
                "placed far from the file's origin: its place is known in coarse steps only"},
    ProblemKind{"far_object", kWrong, "far from all others; move or delete it in the modeller"},
    ProblemKind{"far_object_dropped", kWrong,
                "so far that it cannot belong to the scene: left out"},
    ProblemKind{"far_reaching_object", kWrong, "reaches far beyond all others; look at its size"},
    ProblemKind{"flat_object", kWrong, "scaled to nothing along an axis: it has no inside"},
    ProblemKind{"mirrored_object", kWrong,
                "mirrored: its faces are turned so that they look outwards"},
    // of surfaces
    ProblemKind{"broken_triangle_dropped", kWrong, "vertices that are no places: left out"},
    ProblemKind{"convexity_untried", kWrong,
                "too many faces meet to look for a hull; it stays triangles, as exact and slower"},
    ProblemKind{"degenerate_triangle", kWrong, "triangles without area; harmless, left out"},
    ProblemKind{"duplicate_triangle", kWrong, "the same triangle twice; harmless, may flicker"},
    ProblemKind{"inconsistent_winding", kWrong,
                "neighbouring faces look different ways; turned where the rest tells how"},
    ProblemKind{"inside_out_solid", kWrong,
                "faces look inwards: taken for the solid that they bound; flip its normals"},
    ProblemKind{"inward_shell", kWrong,
                "a closed shell whose faces look inwards; if it is no room, flip its normals"},
    ProblemKind{"non_manifold_edge", kWrong,
                "more than two faces meet at an edge, so inside and outside are not told apart"},
    ProblemKind{"object_without_area", kWrong, "nothing of it can be touched"},
    ProblemKind{"points_and_lines_dropped", kWrong, "points and lines are not drawn nor touched"},
    ProblemKind{"repeated_object", kWrong,
                "the same shape in the same place twice; delete one, they flicker"},
    // of looks
    ProblemKind{"emissive_texture_ignored", kWrong, "glows by a texture, which is not drawn"},
    ProblemKind{"missing_texture", kWrong, "put the picture beside the model; drawn without"},
    ProblemKind{"opacity_zero", kWrong, "the material is invisible; drawn opaque"},
    ProblemKind{"reduced_texture", kWrong,
                "the pictures are many or large; drawn with fewer pixels"},
    ProblemKind{"unreadable_texture", kWrong, "no PNG or JPEG that can be read; drawn without"},
    ProblemKind{"vertex_colours_ignored", kWrong, "colours of vertices are not drawn"},
    // of IFC
    ProblemKind{"cut_away_product", kWrong, "its openings leave nothing of it"},
    ProblemKind{"missing_product", kWrong, "no reader could make its shape: it is not there"},
    ProblemKind{"opening_unchecked", kWrong, "whether its opening is cut could not be tested"},
    ProblemKind{"openings_unverified", kWrong,
                "read by the second reader, which may leave openings closed"},
    ProblemKind{"uncut_opening", kWrong,
                "a door or window whose wall is closed behind it: nobody gets through"},
    ProblemKind{"map_place", kNote, "where the file's own coordinates lie on a map"},
    ProblemKind{"skipped_openings", kNote, "openings are air"},
    ProblemKind{"skipped_spaces", kNote, "spaces are air"},
    // of what moves
    ProblemKind{"body_without_area", kWrong, "a body of objects without surface: left out"},
    ProblemKind{"collision_shape_alone", kWrong,
                "named as the collision shape of something that is not there"},
    ProblemKind{"extras_without_kind", kWrong, "walk_* without walk_kind: it stands still"},
    ProblemKind{"unsupported_physics", kWrong, "physics of the file that is not simulated"},
    ProblemKind{"collision_suffix", kNote, "made solid, drawn or moving by its name's ending"},
    ProblemKind{"guessed_doors", kNote, "how they open was guessed; a sidecar can say it"},
    ProblemKind{"replaced_bodies", kNote, "told in several places; the first of them counts"},
    ProblemKind{"still_doors", kNote, "doors that stand still; a sidecar can move them"},
    ProblemKind{"still_lifts", kNote, "lifts that stand still; a sidecar can move them"},
};

}  // namespace

ProblemKind kindOf(const Problem& problem) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const ProblemKind& kind) {
    return kind.word == problem.kind;
  });
  return found == kKinds.end() ? ProblemKind{problem.kind, kWrong, {}} : *found;
}

}  // namespace enfilade::scene
