// The ifcplusplus reader, built as a separate module: see ifc_plus_plus.hpp.
#include "scene/import/ifc/ifc_plus_plus.hpp"

#include <ifcpp/geometry/Carve/GeometryConverter.h>
#include <ifcpp/model/BuildingModel.h>
#include <ifcpp/reader/ReaderSTEP.h>

#include <cmath>
#include <cstring>
#include <set>
#include <type_traits>
#include <utility>

#include "scene/import/ifc/ifc_meshes.hpp"

namespace enfilade::scene {
namespace {

using CarveMeshes = carve::mesh::MeshSet<3>;
using CarveFace = carve::mesh::Face<3>;

constexpr std::size_t kTriangleCorners = 3;  // of a triangulated face

/// From the file's Z up to Y up.
Eigen::Affine3d convertZUpToYUp() {
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Affine3d(rotation);
}

/// Forwards ifcplusplus' progress; parsing and meshing each run from 0 to 1.
void forwardProgress(void*, std::shared_ptr<StatusCallback::Message> message) {
  if (!message || message->m_message_type != StatusCallback::MESSAGE_TYPE_PROGRESS_VALUE) return;
  const bool shapes = message->m_progress_type == "geometry";
  sendProgress(shapes ? "shapes (ifcplusplus)" : "parse (ifcplusplus)", message->m_progress_value);
}

/// The steps of loadModelFromString(), but with the header's schema; that function assumes IFC4.
/// loadModelFromFile() requires a locale that may not be installed.
std::shared_ptr<BuildingModel> readModel(std::string text) {
  auto model = std::make_shared<BuildingModel>();
  ReaderSTEP reader;
  static int any = 0;  // ifcplusplus calls back only with a non-null object
  reader.setMessageCallBack(&any, forwardProgress);
  model->clearIfcModel();
  reader.removeComments(text);
  reader.readHeader(text, model);
  reader.readData(text, model);
  model->resolveInverseAttributes();
  model->updateCache();
  return model;
}

/// Collects the triangles of one item in doubles and sends them relative to their centre.
class ItemTriangles {
 public:
  void add(const CarveMeshes& meshes) {
    for (const auto* mesh : meshes.meshes) {
      for (const CarveFace* face : mesh->faces) addFace(*face);
    }
  }
  bool empty() const { return corners_.empty(); }

  /// `fileFromProduct`: metres, Z up.
  IfcPlacedGeometry send(std::uint32_t id, const Eigen::Vector4f& colour,
                         const Eigen::Affine3d& fileFromProduct) const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& corner : corners_) box.extend(corner);
    const Eigen::Vector3d middle = box.center();
    const Eigen::Vector3d centre(std::round(middle.x()), std::round(middle.y()),
                                 std::round(middle.z()));
    IfcGeometry geometry;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      geometry.positions.push_back((corners_[i] - centre).cast<float>());
      geometry.normals.push_back(normals_[i].cast<float>());
      geometry.indices.push_back(static_cast<std::uint32_t>(i));
    }
    sendGeometry(id, geometry);
    IfcPlacedGeometry placed;
    placed.geometry = id;
    placed.colour = colour;
    placed.worldFromGeometry = convertZUpToYUp() * fileFromProduct * Eigen::Translation3d(centre);
    return placed;
  }

 private:
  void addFace(const CarveFace& face) {
    std::vector<Eigen::Vector3d> polygon;
    const auto* edge = face.edge;
    for (std::size_t i = 0; i < face.nVertices(); ++i, edge = edge->next) {
      polygon.emplace_back(edge->vert->v.x, edge->vert->v.y, edge->vert->v.z);
      if (!polygon.back().allFinite()) return;
    }
    // A face has more corners if triangulation failed; it becomes a fan.
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      const Eigen::Vector3d normal = (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
      const Eigen::Vector3d unit =
          normal.norm() > 0 ? normal.normalized().eval() : Eigen::Vector3d::UnitZ().eval();
      for (const auto& corner : {polygon[0], polygon[i - 1], polygon[i]}) {
        corners_.push_back(corner);
        normals_.push_back(unit);
      }
    }
  }

  std::vector<Eigen::Vector3d> corners_, normals_;
};

void triangulate(std::shared_ptr<CarveMeshes>& meshes) {
  for (const auto* mesh : meshes->meshes) {
    for (const CarveFace* face : mesh->faces) {
      if (face->nVertices() == kTriangleCorners) continue;
      CSG_Adapter::retriangulateMeshSet(meshes);
      return;
    }
  }
}

Eigen::Vector4f findColour(const std::vector<std::shared_ptr<AppearanceData>>& item,
                           const std::vector<std::shared_ptr<AppearanceData>>& product) {
  for (const auto* list : {&item, &product}) {
    for (const auto& appearance : *list) {
      if (!appearance || appearance->m_apply_to_geometry_type == AppearanceData::GEOM_TYPE_CURVE) {
        continue;
      }
      const auto& c = appearance->m_color_diffuse;
      const double alpha = appearance->m_set_transparent ? appearance->m_transparency : 1.0;
      return Eigen::Vector4d(c.r(), c.g(), c.b(), alpha).cast<float>();
    }
  }
  return {0.8f, 0.8f, 0.8f, 1};
}

bool isDrawing(const RepresentationData& representation) {
  static const std::set<std::wstring> kDrawings{L"Axis", L"Box",     L"FootPrint", L"Annotation",
                                                L"Plan", L"Profile", L"Reference", L"Clearance"};
  return kDrawings.contains(representation.m_representation_identifier);
}

/// carve's matrices are column-major.
Eigen::Affine3d toAffine(const carve::math::Matrix& matrix) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) result.matrix()(row, column) = matrix.m[column][row];
  }
  return result;
}

void sendProductMeshes(std::uint32_t product, ProductShapeData& shape,
                       std::uint32_t& nextGeometry) {
  const Eigen::Affine3d fileFromProduct = toAffine(shape.getTransform());
  std::vector<IfcPlacedGeometry> placedGeometries;
  for (const auto& representation : shape.m_vec_representations) {
    if (!representation || isDrawing(*representation)) continue;
    for (const auto& item : representation->m_vec_item_data) {
      if (!item) continue;
      ItemTriangles triangles;
      for (auto* list : {&item->m_meshsets, &item->m_meshsets_open}) {
        for (std::shared_ptr<CarveMeshes>& meshes : *list) {
          if (!meshes) continue;
          triangulate(meshes);
          triangles.add(*meshes);
        }
      }
      if (triangles.empty()) continue;
      const auto colour = findColour(item->m_vec_item_appearances, shape.getAppearances());
      placedGeometries.push_back(triangles.send(nextGeometry++, colour, fileFromProduct));
    }
  }
  sendProduct(product, placedGeometries);
}

void sendMeshes(std::string text) {
  sendProgress("parse (ifcplusplus)", 0);
  std::shared_ptr<BuildingModel> model = readModel(std::move(text));
  GeometryConverter converter(model);
  static int any = 0;
  converter.setMessageCallBack(&any, forwardProgress);
  sendProgress("shapes (ifcplusplus)", 0);
  converter.convertGeometry();
  std::uint32_t nextGeometry = 0;
  for (const auto& [id, shape] : converter.getShapeInputData()) {
    if (!shape || id < 0) continue;
    const auto product = static_cast<std::uint32_t>(id);
    try {
      sendProductMeshes(product, *shape, nextGeometry);
    } catch (const std::exception& error) {
      std::string frame(4, '\0');
      std::memcpy(frame.data(), &product, 4);
      frame += error.what();
      sendMessage(ImportMessage::failure, frame.data(), frame.size());
    }
  }
  sendMessage(ImportMessage::done, nullptr, 0);
}

}  // namespace
}  // namespace enfilade::scene

extern "C" [[gnu::visibility("default")]] void enfiladeSendMeshes2(std::string& text) {
  enfilade::scene::sendMeshes(std::move(text));
}
static_assert(std::is_same_v<decltype(enfiladeSendMeshes2), enfilade::scene::SendMeshesFunction>);
