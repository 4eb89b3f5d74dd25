#include "scene/import/ifc/class_names.hpp"

#include <map>
#include <sstream>

#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

/// Names of IFC classes without "Ifc", separated by blanks.
constexpr std::string_view kClassNames = R"(
Actuator AirTerminal AirTerminalBox AirToAirHeatRecovery Alarm Alignment AlignmentCant
AlignmentHorizontal AlignmentSegment AlignmentVertical Annotation AudioVisualAppliance Beam
BeamStandardCase Bearing Boiler Borehole Bridge BridgePart Building BuildingElement
BuildingElementComponent BuildingElementPart BuildingElementProxy BuildingStorey BuiltElement
BuiltSystem Burner CableCarrierFitting CableCarrierSegment CableFitting CableSegment
ChamferEdgeFeature Chiller Chimney CivilElement Coil Column ColumnStandardCase
CommunicationsAppliance Compressor Condenser Controller ConveyorSegment CooledBeam CoolingTower
Course Covering CurtainWall Damper DeepFoundation DiscreteAccessory DistributionBoard
DistributionChamberElement DistributionControlElement DistributionElement DistributionFlowElement
DistributionPort Door DoorStandardCase DuctFitting DuctSegment DuctSilencer EarthworksCut
EarthworksElement EarthworksFill EdgeFeature ElectricAppliance ElectricDistributionBoard
ElectricDistributionPoint ElectricFlowStorageDevice ElectricFlowTreatmentDevice ElectricGenerator
ElectricMotor ElectricTimeControl ElectricalElement Element ElementAssembly ElementComponent
EnergyConversionDevice Engine EquipmentElement EvaporativeCooler Evaporator ExternalSpatialElement
ExternalSpatialStructureElement Facility FacilityPart FacilityPartCommon Fan Fastener FeatureElement
FeatureElementAddition FeatureElementSubtraction Filter FireSuppressionTerminal FlowController
FlowFitting FlowInstrument FlowMeter FlowMovingDevice FlowSegment FlowStorageDevice FlowTerminal
FlowTreatmentDevice Footing FurnishingElement Furniture GeographicElement Geomodel Geoslice
GeotechnicalAssembly GeotechnicalElement GeotechnicalStratum Grid HeatExchanger Humidifier
ImpactProtectionDevice Interceptor JunctionBox Kerb Lamp LightFixture LinearElement
LinearPositioningElement LiquidTerminal MarineFacility MarinePart MechanicalFastener MedicalDevice
Member MemberStandardCase MobileTelecommunicationsAppliance MooringDevice MotorConnection
NavigationElement OpeningElement OpeningStandardCase Outlet Pavement Pile PipeFitting PipeSegment
Plate PlateStandardCase Port PositioningElement Product Project ProjectionElement ProtectiveDevice
ProtectiveDeviceTrippingUnit Proxy Pump Rail Railing Railway RailwayPart Ramp RampFlight Referent
ReinforcedSoil ReinforcingBar ReinforcingElement ReinforcingMesh Road RoadPart Roof
RoundedEdgeFeature SanitaryTerminal Sensor ShadingDevice Sign Signal Site Slab SlabElementedCase
SlabStandardCase SolarDevice Space SpaceHeater SpatialElement SpatialStructureElement SpatialZone
StackTerminal Stair StairFlight SurfaceFeature SwitchingDevice SystemFurnitureElement Tank Tendon
TendonAnchor TendonConduit TrackElement Transformer TransportElement TransportationDevice TubeBundle
UnitaryControlElement UnitaryEquipment Valve Vehicle VibrationIsolator VirtualElement VoidingFeature
Wall WallElementedCase WallStandardCase WasteTerminal Window WindowStandardCase
)";

std::map<std::string, std::string> mapLowerCaseToName() {
  std::map<std::string, std::string> names;
  std::istringstream words{std::string(kClassNames)};
  for (std::string name; words >> name;) names[toLowerCase(name)] = name;
  return names;
}

}  // namespace

std::string formatIfcClassName(std::string_view type) {
  if (type.starts_with("IFC")) type.remove_prefix(3);
  static const std::map<std::string, std::string> knownNames = mapLowerCaseToName();
  const auto known = knownNames.find(toLowerCase(std::string(type)));
  if (known != knownNames.end()) return "Ifc" + known->second;
  std::string name = "Ifc" + std::string(type);  // unknown class: approximate spelling
  for (std::size_t i = 3; i < name.size(); ++i) name[i] = toLowerCase(name[i]);
  if (name.size() > 3 && name[3] >= 'a' && name[3] <= 'z')
    name[3] = static_cast<char>(name[3] - 32);
  return name;
}

}  // namespace enfilade::scene
