// Files that are damaged, altered, foreign or made to mislead: each must be refused with the field's name.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "formats/model_file.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::hostile_test {
namespace {

using Path = std::filesystem::path;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

const Path& good_file() {
  static const Folder folder;
  static const Path path = [] {
    write_sample(folder / "good.palpate.hdf");
    return folder / "good.palpate.hdf";
  }();
  return path;
}

/// Four quads in the plane.
const Path& good_plane_file() {
  static const Folder folder;
  static const Path path = [] {
    write_sample(folder / "plane.palpate.hdf", Precision::double_precision, ElementType::quad4);
    return folder / "plane.palpate.hdf";
  }();
  return path;
}

/// An edit whose checksums are made right again, and what the refusal must say.
struct Edit {
  const char* name;
  void (*apply)(const Path&);
  std::vector<std::string> says;
};

void PrintTo(const Edit& edit, std::ostream* out) {
  *out << edit.name;
}

void expect_refused(const Path& good, const Edit& edit) {
  const Folder folder;
  const Path path = folder / "x.palpate.hdf";
  std::filesystem::copy_file(good, path);
  edit.apply(path);
  reseal(path);
  const std::string text = refusal([&] { load_model(path); });
  ASSERT_NE(text, "");
  for (const std::string& words : edit.says) EXPECT_NE(text.find(words), std::string::npos) << text;
  EXPECT_NE(text.find("x.palpate.hdf"), std::string::npos) << text;
}

class Hostile : public testing::TestWithParam<Edit> {};
TEST_P(Hostile, IsRefusedByName) {
  expect_refused(good_file(), GetParam());
}

class HostilePlane : public testing::TestWithParam<Edit> {};
TEST_P(HostilePlane, IsRefusedByName) {
  expect_refused(good_plane_file(), GetParam());
}

const Edit edits[] = {
    // sizes, types and presence
    {"MissingDataset",
     [](const Path& p) { remove_object(p, "/mesh/regions"); },
     {"/mesh/regions is missing"}},
    {"MissingGroup", [](const Path& p) { remove_object(p, "/mesh"); }, {"/mesh/nodes is missing"}},
    {"MissingGreens",
     [](const Path& p) { remove_object(p, "/greens/packed"); },
     {"/greens/packed is missing"}},
    {"MissingProbes",
     [](const Path& p) { remove_object(p, "/probes/forces"); },
     {"/probes/forces is missing"}},
    {"SoftLinkInPlaceOfDataset",
     [](const Path& p) { replace_by_soft_link(p, "/mesh/regions", "/mesh/types"); },
     {"/mesh/regions is missing"}},
    {"SoftLinkToItself",
     [](const Path& p) { replace_by_soft_link(p, "/mesh/regions", "/mesh/regions"); },
     {"/mesh/regions is missing"}},
    {"WrongType",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F32LE, {27, 3});
     },
     {"/mesh/nodes holds float32, float64 is expected"}},
    {"BigEndian",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64BE, {27, 3});
     },
     {"/mesh/nodes holds another type"}},
    {"WrongRank",
     [](const Path& p) { replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {81}); },
     {"/mesh/nodes has 1 dimensions, 2 are expected"}},
    {"HighRank",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {3, 3, 1, 1, 1, 1, 3, 3});
     },
     {"/mesh/nodes has 8 dimensions"}},
    {"Scalar",
     [](const Path& p) { replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {}); },
     {"/mesh/nodes has 0 dimensions"}},
    {"TwoColumns",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {27, 2});
     },
     {"/mesh/nodes has size 2, 3 is expected"}},
    {"NoNodes",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {0, 3});
     },
     {"/mesh/nodes has 0 entries, at least 3"}},
    {"HugeSize",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {1 << 27, 3});
     },
     {"/mesh/nodes", "needs 3221225472 bytes, more than the file holds"}},
    {"ImpossibleSize",
     [](const Path& p) { replace(p, "/model_toml", H5T_STD_U8LE, {(hsize_t{1} << 62)}); },
     {"/model_toml", "more than the file holds"}},
    {"TooManyNodes",
     [](const Path& p) {
       replace(p, "/mesh/nodes", H5T_IEEE_F64LE, {hsize_t{1} << 40, 3});
     },
     {"/mesh/nodes", "more than the file holds"}},
    {"TooShort",
     [](const Path& p) { replace(p, "/dofs/fixed", H5T_STD_U8LE, {26}); },
     {"/dofs/fixed has size 26, 27 is expected by /mesh/nodes"}},
    {"NotWholeElements",
     [](const Path& p) { replace(p, "/mesh/connectivity", H5T_STD_I64LE, {191}); },
     {"/mesh/connectivity has size 191"}},
    {"NoElements",
     [](const Path& p) { replace(p, "/mesh/connectivity", H5T_STD_I64LE, {0}); },
     {"/mesh/connectivity has 0 entries"}},
    {"NoStoredNodes",
     [](const Path& p) { replace(p, "/dofs/stored_nodes", H5T_STD_I32LE, {0}); },
     {"/dofs/stored_nodes has 0 entries"}},
    {"FewerStoredNodes",
     [](const Path& p) {
       const std::vector<std::int32_t> nodes = {26, 25, 24};
       replace(p, "/dofs/stored_nodes", H5T_STD_I32LE, {3}, nodes.data());
     },
     {"/probes/forces has size 54, 9 is expected by /dofs/stored_nodes"}},
    {"GreensTooShort",
     [](const Path& p) { replace(p, "/greens/packed", H5T_IEEE_F64LE, {1484}); },
     {"/greens/packed has 1484 entries, 1485 are expected"}},
    {"GreensOfAnotherPrecision",
     [](const Path& p) { replace(p, "/greens/packed", H5T_IEEE_F32LE, {1485}); },
     {"/greens/packed holds float32, float64 is expected"}},
    {"ScalarOfAnotherPrecision",
     [](const Path& p) { set_text(p, "scalar", "float32"); },
     {"/greens/packed holds float64, float32 is expected"}},
    {"InPieces",
     [](const Path& p) { replace(p, "/greens/packed", H5T_IEEE_F64LE, {1485}, nullptr, true); },
     {"/greens/packed is not stored in one piece"}},
    {"FewerDisplacements",
     [](const Path& p) {
       replace(p, "/probes/displacements", H5T_IEEE_F64LE, {1, 54});
     },
     {"/probes/displacements has size 1, 2 is expected by /probes/forces"}},
    {"GroupInPlaceOfDataset",
     [](const Path& p) {
       remove_object(p, "/model_toml");
       replace(p, "/model_toml/x", H5T_STD_U8LE, {1});
     },
     {"/model_toml"}},

    // values
    {"NanNode",
     [](const Path& p) { set_entry(p, "/mesh/nodes", 5, nan); },
     {"/mesh/nodes holds a value that is not finite (entry 5)"}},
    {"InfiniteNode",
     [](const Path& p) { set_entry(p, "/mesh/nodes", 80, -infinity); },
     {"/mesh/nodes holds a value that is not finite (entry 80)"}},
    {"NodeNumberTooLarge",
     [](const Path& p) { set_entry(p, "/mesh/connectivity", 7, std::int64_t{27}); },
     {"/mesh/connectivity holds 27 (entry 7), only 0 to 26"}},
    {"NodeNumberNegative",
     [](const Path& p) { set_entry(p, "/mesh/connectivity", 0, std::int64_t{-1}); },
     {"/mesh/connectivity holds -1"}},
    {"NodeNumberBeyondInt32",
     [](const Path& p) { set_entry(p, "/mesh/connectivity", 0, std::int64_t{1} << 32); },
     {"/mesh/connectivity holds 4294967296"}},
    {"WrongOffset",
     [](const Path& p) { set_entry(p, "/mesh/offsets", 3, std::int64_t{13}); },
     {"/mesh/offsets holds 13 (entry 3), 12 is expected"}},
    {"AnotherElement",
     [](const Path& p) { set_entry(p, "/mesh/types", 2, std::uint8_t{12}); },
     {"/mesh/types holds 12 (entry 2), 10 is expected"}},
    {"InvertedElement",
     [](const Path& p) {
       set_entry(p, "/mesh/connectivity", 0, std::int64_t{1});
       set_entry(p, "/mesh/connectivity", 1, std::int64_t{0});
     },
     {"/mesh/connectivity: element 0 is inverted or flat"}},
    {"FlatElement",
     [](const Path& p) {
       for (std::uint64_t i = 20; i < 24; ++i) set_entry(p, "/mesh/connectivity", i, std::int64_t{1});
     },
     {"/mesh/connectivity: element 5 is inverted or flat"}},
    {"SurfaceNodeOutOfRange",
     [](const Path& p) { set_entry(p, "/mesh/surface", 4, std::int32_t{1000}); },
     {"/mesh/surface holds 1000 (entry 4), only 0 to 26"}},
    {"SurfaceTriangleWithOneNodeTwice",
     [](const Path& p) {
       set_entry(p, "/mesh/surface", 3, std::int32_t{2});
       set_entry(p, "/mesh/surface", 5, std::int32_t{2});
     },
     {"/mesh/surface: row 1 has the same node twice"}},
    {"FixedMaskTooLarge",
     [](const Path& p) { set_entry(p, "/dofs/fixed", 26, std::uint8_t{8}); },
     {"/dofs/fixed holds 8 (entry 26), only 0 to 7"}},
    {"StoredNodeOutOfRange",
     [](const Path& p) { set_entry(p, "/dofs/stored_nodes", 0, std::int32_t{27}); },
     {"/dofs/stored_nodes holds 27"}},
    {"StoredNodeTwice",
     [](const Path& p) { set_entry(p, "/dofs/stored_nodes", 0, std::int32_t{25}); },
     {"/dofs/stored_nodes: node 25 is there twice"}},
    {"StoredNodeFixed",
     [](const Path& p) { set_entry(p, "/dofs/stored_nodes", 0, std::int32_t{0}); },
     {"/dofs/stored_nodes: node 0 is fixed"}},
    {"StoredNodeFixedAlongOneAxis",
     [](const Path& p) { set_entry(p, "/dofs/fixed", 20, std::uint8_t{4}); },
     {"/greens/packed: diagonal entry 20 is not zero, though its dof is held"}},
    {"NegativeYoungsModulus",
     [](const Path& p) { set_entry(p, "/material/isotropic", 0, -1.0); },
     {"/material/isotropic"}},
    {"IncompressibleMaterial",
     [](const Path& p) { set_entry(p, "/material/isotropic", 1, 0.5); },
     {"/material/isotropic"}},
    {"NanDensity",
     [](const Path& p) { set_entry(p, "/material/isotropic", 2, nan); },
     {"/material/isotropic"}},
    {"SecondMaterialIncompressible",
     [](const Path& p) { set_entry(p, "/material/isotropic", 4, 0.5); },
     {"/material/isotropic, row 1", "poissons_ratio"}},
    {"NegativeFriction",
     [](const Path& p) { set_entry(p, "/material/friction", 1, -0.5); },
     {"/material/friction, row 1 is -0.5", "0 or more"}},
    {"NanFriction",
     [](const Path& p) { set_entry(p, "/material/friction", 0, nan); },
     {"/material/friction holds a value that is not finite (entry 0)"}},
    {"InfiniteFriction",
     [](const Path& p) { set_entry(p, "/material/friction", 1, infinity); },
     {"/material/friction holds a value that is not finite (entry 1)"}},
    {"NoFriction",
     [](const Path& p) { remove_object(p, "/material/friction"); },
     {"/material/friction is missing"}},
    {"FewerFrictions",
     [](const Path& p) { replace(p, "/material/friction", H5T_IEEE_F64LE, {1}); },
     {"/material/friction has size 1, 2 is expected by /material/isotropic"}},
    {"InfiniteInitialStrain",
     [](const Path& p) { set_entry(p, "/material/initial_strain", 7, infinity); },
     {"/material/initial_strain holds a value that is not finite (entry 7)"}},
    {"NoMaterials",
     [](const Path& p) {
       replace(p, "/material/isotropic", H5T_IEEE_F64LE, {0, 3});
     },
     {"/material/isotropic has 0 entries, at least 1"}},
    {"ManyMaterials",
     [](const Path& p) {
       replace(p, "/material/isotropic", H5T_IEEE_F64LE, {hsize_t{1} << 40, 3});
     },
     {"/material/isotropic", "more than the file holds"}},
    {"FewerInitialStrains",
     [](const Path& p) {
       replace(p, "/material/initial_strain", H5T_IEEE_F64LE, {1, 6});
     },
     {"/material/initial_strain has size 1, 2 is expected by /material/isotropic"}},
    {"InitialStrainOfThreeComponents",
     [](const Path& p) {
       replace(p, "/material/initial_strain", H5T_IEEE_F64LE, {2, 3});
     },
     {"/material/initial_strain has size 3, 6 is expected"}},
    {"MaterialOfElementOutOfRange",
     [](const Path& p) { set_entry(p, "/material/of_element", 47, std::int32_t{2}); },
     {"/material/of_element holds 2 (entry 47), only 0 to 1"}},
    {"MaterialOfElementNegative",
     [](const Path& p) { set_entry(p, "/material/of_element", 0, std::int32_t{-1}); },
     {"/material/of_element holds -1 (entry 0)"}},
    {"FewerMaterialsOfElements",
     [](const Path& p) { replace(p, "/material/of_element", H5T_STD_I32LE, {47}); },
     {"/material/of_element has size 47, 48 is expected by /mesh/connectivity"}},
    {"ThicknessInSpace",
     [](const Path& p) { set_entry(p, "/material/thickness", 0, 2.0); },
     {"/material/thickness is 2.0", "in space it is 1"}},
    {"NanRestForce",
     [](const Path& p) { set_entry(p, "/rest/force", 80, nan); },
     {"/rest/force holds a value that is not finite (entry 80)"}},
    {"NanRestDisplacement",
     [](const Path& p) { set_entry(p, "/rest/displacement", 2, nan); },
     {"/rest/displacement holds a value that is not finite (entry 2)"}},
    {"FewerRestForces",
     [](const Path& p) {
       replace(p, "/rest/force", H5T_IEEE_F64LE, {26, 3});
     },
     {"/rest/force has size 26, 27 is expected by /mesh/nodes"}},
    {"RestDisplacementOfTwoComponents",
     [](const Path& p) {
       replace(p, "/rest/displacement", H5T_IEEE_F64LE, {27, 2});
     },
     {"/rest/displacement has size 2, 3 is expected"}},
    {"WorstElementOutOfRange",
     [](const Path& p) { set_entry(p, "/quality/summary", 7, 48.0); },
     {"/quality/summary"}},
    {"WorstElementHuge",
     [](const Path& p) { set_entry(p, "/quality/summary", 7, 1e300); },
     {"/quality/summary"}},
    {"NegativeHistogram",
     [](const Path& p) { set_entry(p, "/quality/angle_histogram", 2, std::int64_t{-1}); },
     {"/quality/angle_histogram holds -1"}},
    {"MoreAnglesThanThereAre",
     [](const Path& p) { set_entry(p, "/quality/angle_histogram", 2, std::int64_t{48 * 6 + 1}); },
     {"/quality/angle_histogram holds 289 (entry 2), only 0 to 288"}},
    {"NanProbe",
     [](const Path& p) { set_entry(p, "/probes/displacements", 100, nan); },
     {"/probes/displacements holds a value that is not finite (entry 100)"}},
    {"NanGreens",
     [](const Path& p) { set_entry(p, "/greens/packed", 1477, nan); },
     {"/greens/packed holds a value that is not finite (entry 1477)"}},
    {"InfiniteGreens",
     [](const Path& p) { set_entry(p, "/greens/packed", 3, infinity); },
     {"/greens/packed holds a value that is not finite (entry 3)"}},
    {"ZeroDiagonal",
     [](const Path& p) { set_entry(p, "/greens/packed", 54, 0.0); },
     {"/greens/packed: diagonal entry 1 is not positive"}},
    {"NegativeDiagonal",
     [](const Path& p) { set_entry(p, "/greens/packed", 1484, -1e-3); },
     {"/greens/packed: diagonal entry 53 is not positive"}},
    {"SourceWithoutEnd",
     [](const Path& p) { replace(p, "/provenance/sources", H5T_STD_U8LE, {5}, "model"); },
     {"/provenance/sources has an incomplete line"}},
    {"SourceWithoutSize",
     [](const Path& p) { replace(p, "/provenance/sources", H5T_STD_U8LE, {12}, "model x y z\n"); },
     {"/provenance/sources has a line with an unreadable size"}},
    {"SourceWithoutChecksum",
     [](const Path& p) { replace(p, "/provenance/sources", H5T_STD_U8LE, {12}, "model 1 y z\n"); },
     {"/provenance/sources has a line that is not"}},
    {"AnotherNumberOfPoints",
     [](const Path& p) { set_entry(p, "/VTKHDF/NumberOfPoints", 0, std::int64_t{5}); },
     {"/VTKHDF/NumberOfPoints holds 5 (entry 0), 27 is expected"}},

    // attributes
    {"AnotherFormat", [](const Path& p) { set_text(p, "format", "sofa"); }, {"not a Palpate file"}},
    {"NoFormat", [](const Path& p) { remove_attribute(p, "/", "format"); }, {"not a Palpate file"}},
    {"NewerMajor",
     [](const Path& p) {
       set_integers(p, "version", {5, 1});
     },
     {"format version 5.1", "reads version 4.x", "Precompute it again"}},
    {"OlderMajor",
     [](const Path& p) {
       set_integers(p, "version", {3, 6});
     },
     {"format version 3.6", "reads version 4.x", "Precompute it again"}},
    {"NegativeMinor",
     [](const Path& p) {
       set_integers(p, "version", {4, -1});
     },
     {"version is negative"}},
    {"NoVersion",
     [](const Path& p) { remove_attribute(p, "/", "version"); },
     {"attribute version is missing"}},
    {"VersionOfOneNumber",
     [](const Path& p) { set_integers(p, "version", {4}); },
     {"attribute version is missing"}},
    {"NoName", [](const Path& p) { remove_attribute(p, "/", "name"); }, {"attribute name is missing"}},
    {"NumberAsName", [](const Path& p) { set_integers(p, "name", {1}); }, {"attribute name is missing"}},
    {"LongName",
     [](const Path& p) { set_text(p, "name", std::string(5000, 'x')); },
     {"attribute name is missing"}},
    {"OtherUnits",
     [](const Path& p) { set_text(p, "units", "mm"); },
     {"attribute units has an unknown value"}},
    {"OtherDimension",
     [](const Path& p) { set_integers(p, "dimension", {2}); },
     {"attribute dimension is 2, that of tet4 elements is 3"}},
    {"NoElement",
     [](const Path& p) { remove_attribute(p, "/", "element"); },
     {"attribute element is missing"}},
    {"UnknownElement",
     [](const Path& p) { set_text(p, "element", "wedge6"); },
     {"attribute element is 'wedge6', not tri3, quad4, tet4, tet4a, tet10 or hex8"}},
    {"ElementOfTheBoundary",
     [](const Path& p) { set_text(p, "element", "tri6"); },
     {"attribute element is 'tri6'"}},
    {"ElementOfAnotherDimension",
     [](const Path& p) { set_text(p, "element", "quad4"); },
     {"attribute dimension is 3, that of quad4 elements is 2"}},
    {"ElementOfThePlane",
     [](const Path& p) {
       set_text(p, "element", "quad4");
       set_integers(p, "dimension", {2});
     },
     {"/mesh/types holds 10 (entry 0), 9 is expected"}},
    {"ElementOfMoreNodes",
     [](const Path& p) { set_text(p, "element", "hex8"); },
     {"/mesh/offsets has size 49, 25 is expected by /mesh/connectivity"}},
    {"UnknownAnalysis",
     [](const Path& p) { set_text(p, "analysis", "shell"); },
     {"attribute analysis is 'shell', not solid, plane_stress or plane_strain"}},
    {"PlaneAnalysisInSpace",
     [](const Path& p) { set_text(p, "analysis", "plane_strain"); },
     {"attribute analysis is plane_strain, but tet4 elements are in space"}},
    {"OtherScalar",
     [](const Path& p) { set_text(p, "scalar", "float16"); },
     {"attribute scalar is 'float16'"}},
    {"ScopeNone", [](const Path& p) { set_text(p, "scope", "none"); }, {"the scope is none"}},
    {"OtherScope", [](const Path& p) { set_text(p, "scope", "all"); }, {"attribute scope is 'all'"}},
    {"NegativeLayers", [](const Path& p) { set_integers(p, "layers", {-1}); }, {"attribute layers is -1"}},
    {"ManyLayers",
     [](const Path& p) { set_integers(p, "layers", {std::int64_t{1} << 40}); },
     {"attribute layers is"}},
    // overlays
    {"OverlayWithoutCentres",
     [](const Path& p) { remove_object(p, "/overlay/centres"); },
     {"/overlay/centres is missing"}},
    {"OverlayRefinementZero",
     [](const Path& p) { set_entry(p, "/overlay/refinement", 0, std::int32_t{0}); },
     {"/overlay/refinement is 0"}},
    {"OverlayRefinementLarge",
     [](const Path& p) { set_entry(p, "/overlay/refinement", 0, std::int32_t{17}); },
     {"/overlay/refinement is 17, only 2 to 16"}},
    {"OverlayRingsNegative",
     [](const Path& p) { set_entry(p, "/overlay/rings", 0, std::int32_t{-1}); },
     {"/overlay/rings is -1, only 1 to 16"}},
    {"OverlayCentreOutside",
     [](const Path& p) { set_entry(p, "/overlay/centres", 1, std::int32_t{27}); },
     {"/overlay/centres holds 27 (entry 1)"}},
    {"OverlayCentreInside",
     [](const Path& p) { set_entry(p, "/overlay/centres", 0, std::int32_t{13}); },
     {"/overlay/centres: node 13 is not on the surface"}},
    {"OverlayCentreHeld",
     [](const Path& p) { set_entry(p, "/overlay/centres", 0, std::int32_t{0}); },
     {"/overlay/centres: node 0 is not stored"}},
    {"OverlayCentresTheSame",
     [](const Path& p) { set_entry(p, "/overlay/centres", 0, std::int32_t{26}); },
     {"/overlay/centres: entry 1 is not greater"}},
    {"OverlayOfMoreNodesThanTheBody",
     [](const Path& p) { set_entry(p, "/overlay/nodes", 0, std::int32_t{28}); },
     {"/overlay/nodes holds 28 (entry 0), only 0 to 27"}},
    {"OverlayOfMoreNodes",
     [](const Path& p) { set_entry(p, "/overlay/nodes", 0, std::int32_t{20}); },
     {"/overlay/G ends within patch 0"}},
    {"OverlayOfFewerNodes",
     [](const Path& p) { set_entry(p, "/overlay/nodes", 1, std::int32_t{2}); },
     {"/overlay/G has 24 entries more"}},
    {"OverlayOfHugeSurface",
     [](const Path& p) { set_entry(p, "/overlay/surface_nodes", 1, std::int32_t{1} << 28); },
     {"/overlay/surface ends within patch 1"}},
    {"OverlaySurfaceNegative",
     [](const Path& p) { set_entry(p, "/overlay/surface", 2, std::int32_t{-5}); },
     {"/overlay/surface holds -5 (entry 2)"}},
    {"OverlaySurfaceDescends",
     [](const Path& p) { set_entry(p, "/overlay/surface", 1, std::int32_t{1}); },
     {"/overlay/surface: the nodes of patch 0 do not ascend"}},
    {"OverlayTransferTooShort",
     [](const Path& p) { replace(p, "/overlay/T", H5T_IEEE_F64LE, {80}); },
     {"/overlay/T ends within patch 1"}},
    {"OverlayNotFinite",
     [](const Path& p) { set_entry(p, "/overlay/G", 7, nan); },
     {"/overlay/G holds a value that is not finite (entry 7)"}},
    {"OverlayPullsBack",
     [](const Path& p) { set_entry(p, "/overlay/compliance", 0, -1.0); },
     {"/overlay/compliance: patch 0 has a negative diagonal"}},
    {"NoChecksum",
     [](const Path& p) { remove_attribute(p, "/mesh/nodes", "xxh3"); },
     {"/mesh/nodes has no checksum"}},
};

INSTANTIATE_TEST_SUITE_P(Files, Hostile, testing::ValuesIn(edits),
                         [](const auto& edit) { return std::string(edit.param.name); });

const Edit plane_edits[] = {
    {"SolidAnalysis",
     [](const Path& p) { set_text(p, "analysis", "solid"); },
     {"attribute analysis is solid, but quad4 elements are in the plane"}},
    {"NodeOutOfThePlane",
     [](const Path& p) { set_entry(p, "/mesh/nodes", 14, 0.25); },
     {"/mesh/nodes: row 4 has z = 0.25"}},
    {"RestForceOutOfThePlane",
     [](const Path& p) { set_entry(p, "/rest/force", 2, 0.5); },
     {"/rest/force: row 0 has z = 0.5"}},
    {"RestDisplacementOutOfThePlane",
     [](const Path& p) { set_entry(p, "/rest/displacement", 26, -0.5); },
     {"/rest/displacement: row 8 has z = -0.5"}},
    {"FixedMaskTooLarge",
     [](const Path& p) { set_entry(p, "/dofs/fixed", 0, std::uint8_t{4}); },
     {"/dofs/fixed holds 4 (entry 0), only 0 to 3"}},
    {"SurfaceOfTriangles",
     [](const Path& p) {
       replace(p, "/mesh/surface", H5T_STD_I32LE, {8, 3});
     },
     {"/mesh/surface has size 3, 2 is expected"}},
    {"SurfaceLineToItself",
     [](const Path& p) {
       set_entry(p, "/mesh/surface", 4, std::int32_t{2});
       set_entry(p, "/mesh/surface", 5, std::int32_t{2});
     },
     {"/mesh/surface: row 2 has the same node twice"}},
    {"TriangleInPlaceOfQuad",
     [](const Path& p) { set_entry(p, "/mesh/types", 1, std::uint8_t{5}); },
     {"/mesh/types holds 5 (entry 1), 9 is expected"}},
    {"ElementOfFewerNodes",
     [](const Path& p) { set_text(p, "element", "tri3"); },
     {"/mesh/connectivity has size 16, 15 is expected"}},
    {"FlatElement",
     [](const Path& p) {
       for (std::uint64_t i = 4; i < 8; ++i) set_entry(p, "/mesh/connectivity", i, std::int64_t(i % 2));
     },
     {"/mesh/connectivity: element 1 is inverted or flat"}},
    {"InvertedElement",
     [](const Path& p) {
       set_entry(p, "/mesh/connectivity", 0, std::int64_t{3});
       set_entry(p, "/mesh/connectivity", 3, std::int64_t{0});
     },
     {"/mesh/connectivity: element 0 is inverted or flat"}},
    {"NoThickness",
     [](const Path& p) { set_entry(p, "/material/thickness", 0, 0.0); },
     {"/material/thickness is 0.0", "not positive"}},
    {"ThreeForcesANode",
     [](const Path& p) {
       replace(p, "/probes/forces", H5T_IEEE_F64LE, {2, 18});
     },
     {"/probes/forces has size 18, 12 is expected by /dofs/stored_nodes"}},
    {"GreensOfThreeDofsANode",
     [](const Path& p) { replace(p, "/greens/packed", H5T_IEEE_F64LE, {171}); },
     {"/greens/packed has 171 entries, 78 are expected"}},
};

INSTANTIATE_TEST_SUITE_P(Files, HostilePlane, testing::ValuesIn(plane_edits),
                         [](const auto& edit) { return std::string(edit.param.name); });

TEST(AlteredFile, EveryDatasetIsNamed) {
  const auto datasets = checked_datasets(good_file());
  EXPECT_EQ(datasets.size(), 34U);
  for (const std::string& dataset : datasets) {
    const Folder folder;
    std::filesystem::copy_file(good_file(), folder / "x.hdf");
    ASSERT_TRUE(set_entry(folder / "x.hdf", dataset, 0, std::uint8_t{0xa7}));
    const std::string text = refusal([&] { load_model(folder / "x.hdf"); });
    EXPECT_NE(text.find(dataset + " was altered"), std::string::npos) << text;
  }
}

TEST(AlteredFile, AttributesAreNoticed) {
  const Folder folder;
  std::filesystem::copy_file(good_file(), folder / "x.hdf");
  set_text(folder / "x.hdf", "name", "another");
  EXPECT_NE(refusal([&] { load_model(folder / "x.hdf"); }).find("content_hash"), std::string::npos);
  remove_attribute(folder / "x.hdf", "/", "content_hash");
  EXPECT_NE(refusal([&] { load_model(folder / "x.hdf"); }).find("content_hash is missing"),
            std::string::npos);
}

TEST(FileWithout, Overlays) {
  const Folder folder;
  std::filesystem::copy_file(good_file(), folder / "x.hdf");
  remove_object(folder / "x.hdf", "/overlay");
  EXPECT_NE(refusal([&] { load_model(folder / "x.hdf"); }).find("content_hash"), std::string::npos);
  reseal(folder / "x.hdf");
  const Model read = load_model(folder / "x.hdf");
  EXPECT_EQ(read.overlay.refinement, 0);
  EXPECT_EQ(difference(load_model(good_file()), read), "overlay");
}

TEST(NewerMinorVersion, IsReadAndWhatItAddsIsIgnored) {
  const Folder folder;
  std::filesystem::copy_file(good_file(), folder / "x.hdf");
  set_integers(folder / "x.hdf", "version", {4, 1});
  replace(folder / "x.hdf", "/mesh/colours", H5T_STD_U8LE, {27});
  reseal(folder / "x.hdf");
  EXPECT_EQ(difference(load_model(good_file()), load_model(folder / "x.hdf")), "");
}

TEST(ForeignFile, IsCalledSo) {
  const Folder folder;
  write_bytes(folder / "text",
              "name = 1\nE = 5000 Pa, and enough text to be longer than what files begin with.\n");
  EXPECT_NE(refusal([&] { load_model(folder / "text"); }).find("is not a Palpate file"), std::string::npos);
  write_bytes(folder / "empty", "");
  EXPECT_NE(refusal([&] { load_model(folder / "empty"); }).find("empty"), std::string::npos);
  EXPECT_NE(refusal([&] { load_model(folder / "none"); }).find("No such file"), std::string::npos);
  EXPECT_NE(refusal([&] { load_model(folder.path()); }).find("not a file"), std::string::npos);
}

TEST(ForeignFile, OfHdf5IsCalledSo) {
  const Folder folder;
  for (const bool latest : {false, true}) {
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (latest) H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
    H5Fclose(H5Fcreate((folder / "foreign.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access));
    H5Pclose(access);
    const std::string text = refusal([&] { load_model(folder / "foreign.h5"); });
    EXPECT_NE(text.find("is an HDF5 file, but not a Palpate file"), std::string::npos) << text;
    EXPECT_NE(text.find("palpate-precompute index"), std::string::npos) << text;
  }
}

TEST(TruncatedFile, IsCalledSoWhereverItEnds) {
  const Folder folder;
  const std::string whole = read_bytes(good_file());
  std::vector<std::size_t> lengths = {1, 7, 8, 9, 12, 28, 47, 48, 49, 100, whole.size() - 1};
  for (std::size_t i = 1; i < 50; ++i) lengths.push_back(whole.size() * i / 50);
  for (const std::size_t length : lengths) {
    write_bytes(folder / "cut.hdf", whole.substr(0, length));
    const std::string text = refusal([&] { load_model(folder / "cut.hdf"); });
    EXPECT_NE(text.find("truncated"), std::string::npos) << length << ": " << text;
  }
}

class FlippedBits : public ::testing::TestWithParam<unsigned> {};

TEST_P(FlippedBits, AreRefusedOrInSlackSpace) {
  const Folder folder;
  const std::string whole = read_bytes(good_file());
  const Model good = load_model(good_file());
  std::mt19937_64 random(GetParam());
  int refused = 0;
  for (int i = 0; i < 50; ++i) {
    std::string flipped = whole;
    // Half of them in the first page, which is the index's.
    const std::size_t byte = random() % (i % 2 == 0 ? whole.size() : 4096);
    flipped[byte] = static_cast<char>(flipped[byte] ^ (1 << (random() % 8)));
    write_bytes(folder / "x.hdf", flipped);
    std::string text =
        refusal([&] { EXPECT_EQ(difference(good, load_model(folder / "x.hdf")), "") << "byte " << byte; });
    if (!text.empty()) ++refused;
  }
  EXPECT_GT(refused, 25);
}

INSTANTIATE_TEST_SUITE_P(Seeds, FlippedBits, ::testing::Range(1U, 9U));

}  // namespace
}  // namespace palpate::test::hostile_test
