// A library of its own: see ifc_plus_plus.hpp.
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

constexpr std::size_t kMostCorners = 3;  // of a face once all are triangles

/// File, Z up, to ours.
Eigen::Affine3d yUpFromZUp() {
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Affine3d(turn);
}

/// Passes ifcplusplus' progress on. It counts reading and shapes from 0 to 1 each.
void forwardProgress(void*, std::shared_ptr<StatusCallback::Message> message) {
  if (!message || message->m_message_type != StatusCallback::MESSAGE_TYPE_PROGRESS_VALUE) return;
  const bool shapes = message->m_progress_type == "geometry";
  sendProgress(shapes ? "shapes (ifcplusplus)" : "parse (ifcplusplus)", message->m_progress_value);
}

/// The steps of loadModelFromString(), but with the schema that the header says; that function
/// leaves it at IFC4, and loadModelFromFile() wants a locale that may not be there.
std::shared_ptr<BuildingModel> readModel(std::string text) {
  auto model = std::make_shared<BuildingModel>();
  ReaderSTEP reader;
  static int any = 0;  // ifcplusplus calls nobody back without an object
  reader.setMessageCallBack(&any, forwardProgress);
  model->clearIfcModel();
  reader.removeComments(text);
  reader.readHeader(text, model);
  reader.readData(text, model);
  model->resolveInverseAttributes();
  model->updateCache();
  return model;
}

/// Gathers the triangles of one item in doubles and sends them about their own centre.
class ItemTriangles {
 public:
  void add(const CarveMeshes& meshes) {
    for (const auto* mesh : meshes.meshes) {
      for (const CarveFace* face : mesh->faces) addFace(*face);
    }
  }
  bool empty() const { return corners_.empty(); }

  /// `fileFromProduct`: metres, Z up.
  IfcPart send(std::uint32_t id, const Eigen::Vector4f& colour,
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
    IfcPart part;
    part.geometry = id;
    part.colour = colour;
    part.worldFromGeometry = yUpFromZUp() * fileFromProduct * Eigen::Translation3d(centre);
    return part;
  }

 private:
  void addFace(const CarveFace& face) {
    std::vector<Eigen::Vector3d> polygon;
    const auto* edge = face.edge;
    for (std::size_t i = 0; i < face.nVertices(); ++i, edge = edge->next) {
      polygon.emplace_back(edge->vert->v.x, edge->vert->v.y, edge->vert->v.z);
      if (!polygon.back().allFinite()) return;
    }
    // More corners are left where triangulating failed: a fan is as good a guess as any.
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
      if (face->nVertices() == kMostCorners) continue;
      CSG_Adapter::retriangulateMeshSet(meshes);
      return;
    }
  }
}

Eigen::Vector4f colourOf(const std::vector<std::shared_ptr<AppearanceData>>& item,
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

/// carve keeps its matrices column by column.
Eigen::Affine3d affineFrom(const carve::math::Matrix& matrix) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) result.matrix()(row, column) = matrix.m[column][row];
  }
  return result;
}

void sendShape(std::uint32_t product, ProductShapeData& shape, std::uint32_t& nextGeometry) {
  const Eigen::Affine3d fileFromProduct = affineFrom(shape.getTransform());
  std::vector<IfcPart> parts;
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
      const auto colour = colourOf(item->m_vec_item_appearances, shape.getAppearances());
      parts.push_back(triangles.send(nextGeometry++, colour, fileFromProduct));
    }
  }
  sendProduct(product, parts);
}

void sendShapes(std::string text) {
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
      sendShape(product, *shape, nextGeometry);
    } catch (const std::exception& error) {
      std::string frame(4, '\0');
      std::memcpy(frame.data(), &product, 4);
      frame += error.what();
      sendFrame(ImportFrame::failure, frame.data(), frame.size());
    }
  }
  sendFrame(ImportFrame::done, nullptr, 0);
}

}  // namespace
}  // namespace enfilade::scene

extern "C" [[gnu::visibility("default")]] void enfiladeSendShapes1(std::string& text) {
  enfilade::scene::sendShapes(std::move(text));
}
static_assert(std::is_same_v<decltype(enfiladeSendShapes1), enfilade::scene::SendShapes>);
