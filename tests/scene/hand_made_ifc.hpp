// Writer of small IFC2x3 and IFC4 files for tests: a storey with one wall, an opening in the wall,
// and a door in the opening.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace enfilade::tests {

struct IfcHouse {
  std::string schema = "IFC4";
  /// Unit of the lengths below.
  std::string unit = "IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.)";
  double unitsPerMetre = 1000;
  std::string offset = "0.,0.,0.";  ///< of the building, in length units
  bool voids = true;                ///< whether the opening is cut out of the wall
  bool door = true;
  std::string more;  ///< further statements, numbered from #500

  std::string formatLength(double metres) const { return std::to_string(metres * unitsPerMetre); }

  /// A box with one corner at its placement; uses the numbers id .. id + 9.
  std::string makeBox(int id, double width, double depth, double height) const {
    const auto n = [&](int k) { return "#" + std::to_string(id + k); };
    return n(0) + "=IFCCARTESIANPOINT((" + formatLength(width / 2) + "," + formatLength(depth / 2) +
           "));\n" + n(1) + "=IFCAXIS2PLACEMENT2D(" + n(0) + ",$);\n" + n(2) +
           "=IFCRECTANGLEPROFILEDEF(.AREA.,$," + n(1) + "," + formatLength(width) + "," +
           formatLength(depth) + ");\n" + n(3) + "=IFCEXTRUDEDAREASOLID(" + n(2) + ",#11,#13," +
           formatLength(height) + ");\n" + n(4) +
           "=IFCSHAPEREPRESENTATION(#20,'Body','SweptSolid',(" + n(3) + "));\n" + n(5) +
           "=IFCPRODUCTDEFINITIONSHAPE($,$,(" + n(4) + "));\n";
  }
  /// A prism over an outline of x and y at its placement, as makeBox(): its product shape is id
  /// + 5. Uses the numbers id .. id + 9 + corners.
  std::string makePrism(int id, const std::vector<std::array<double, 2>>& outline,
                        double height) const {
    const auto n = [&](std::size_t k) {
      return "#" + std::to_string(static_cast<std::size_t>(id) + k);
    };
    std::string text, corners;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      text += n(10 + i) + "=IFCCARTESIANPOINT((" + formatLength(outline[i][0]) + "," +
              formatLength(outline[i][1]) + "));\n";
      corners += n(10 + i) + ",";
    }
    return text + n(1) + "=IFCPOLYLINE((" + corners + n(10) + "));\n" + n(2) +
           "=IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + n(1) + ");\n" + n(3) +
           "=IFCEXTRUDEDAREASOLID(" + n(2) + ",#11,#13," + formatLength(height) + ");\n" + n(4) +
           "=IFCSHAPEREPRESENTATION(#20,'Body','SweptSolid',(" + n(3) + "));\n" + n(5) +
           "=IFCPRODUCTDEFINITIONSHAPE($,$,(" + n(4) + "));\n";
  }
  std::string makePlacement(int id, const std::string& parent, double x, double y, double z) const {
    const auto n = [&](int k) { return "#" + std::to_string(id + k); };
    return n(0) + "=IFCCARTESIANPOINT((" + formatLength(x) + "," + formatLength(y) + "," +
           formatLength(z) + "));\n" + n(1) + "=IFCAXIS2PLACEMENT3D(" + n(0) + ",$,$);\n" + n(2) +
           "=IFCLOCALPLACEMENT(" + parent + "," + n(1) + ");\n";
  }

  std::string makeText() const {
    const bool four = schema == "IFC4";
    const std::string tail = four ? ",$" : "";  // IFC4 has a predefined type behind the tag
    std::string t =
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),"
        "(''),'','','');\nFILE_SCHEMA(('" +
        schema + "'));\nENDSEC;\nDATA;\n";
    t += "#1=IFCPROJECT('0000000000000000000001',$,'Test house',$,$,$,$,(#20),#30);\n";
    t += "#10=IFCCARTESIANPOINT((" + offset + "));\n#11=IFCAXIS2PLACEMENT3D(#12,$,$);\n";
    t += "#12=IFCCARTESIANPOINT((0.,0.,0.));\n#13=IFCDIRECTION((0.,0.,1.));\n";
    t += "#14=IFCAXIS2PLACEMENT3D(#10,$,$);\n#15=IFCLOCALPLACEMENT($,#14);\n";
    t += "#20=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-05,#11,$);\n";
    t += "#30=IFCUNITASSIGNMENT((#31));\n#31=" + unit + ";\n";
    t += "#40=IFCBUILDING('0000000000000000000002',$,'House',$,$,#15,$,$,.ELEMENT.,$,$,$);\n";
    t += "#41=IFCBUILDINGSTOREY('0000000000000000000003',$,'Ground/"
         "floor',$,$,#15,$,$,.ELEMENT.,0.);\n";
    t += "#42=IFCRELAGGREGATES('0000000000000000000004',$,$,$,#1,(#40));\n";
    t += "#43=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#40,(#41));\n";
    t += makePlacement(100, "#15", 0, 0, 0) + makeBox(110, 4, 0.3, 3);
    t += "#120=IFCWALL('000000000000000000Wall',$,'Wall',$,$,#102,#115,$" + tail + ");\n";
    t += makePlacement(200, "#102", 1.5, 0, 0) + makeBox(210, 0.9, 0.3, 2.1);
    t += "#220=IFCOPENINGELEMENT('000000000000000Opening',$,$,$,$,#202,#215,$" + tail + ");\n";
    std::string contained = "#120";
    if (door) {
      t += makePlacement(300, "#202", 0, 0.1, 0) + makeBox(310, 0.9, 0.05, 2.1);
      t += "#320=IFCDOOR('000000000000000000Door',$,'Front door',$,$,#302,#315,$," +
           formatLength(2.1) + "," + formatLength(0.9) +
           (four ? ",.DOOR.,.SINGLE_SWING_LEFT.,$" : "") + ");\n";
      t += "#321=IFCRELFILLSELEMENT('0000000000000000000006',$,$,$,#220,#320);\n";
      contained += ",#320";
    }
    if (voids) t += "#221=IFCRELVOIDSELEMENT('0000000000000000000007',$,$,$,#120,#220);\n";
    t += "#44=IFCRELCONTAINEDINSPATIALSTRUCTURE('0000000000000000000008',$,$,$,(" + contained +
         "),#41);\n";
    if (!four) t = addOwners(t);
    return t + more + "ENDSEC;\nEND-ISO-10303-21;\n";
  }

  /// Adds owners: IFC2x3 requires an owner history for each entity, and assimp checks it.
  static std::string addOwners(std::string t) {
    const std::string noOwner = "',$,";
    for (std::size_t at = t.find("'0000"); at != std::string::npos; at = t.find("'0000", at + 1)) {
      if (t.compare(at + 23, noOwner.size(), noOwner) == 0) t.replace(at + 23, 4, "',#5,");
    }
    return t +
           "#2=IFCPERSON($,$,'',$,$,$,$,$);\n#3=IFCORGANIZATION($,'x',$,$,$);\n"
           "#4=IFCPERSONANDORGANIZATION(#2,#3,$);\n#6=IFCAPPLICATION(#3,'1','x','x');\n"
           "#5=IFCOWNERHISTORY(#4,#6,$,.ADDED.,$,$,$,0);\n";
  }
};

}  // namespace enfilade::tests
