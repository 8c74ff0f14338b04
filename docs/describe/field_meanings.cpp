#include "docs/describe/field_meanings.h"

#include <array>

namespace palpate {
namespace {

constexpr FieldMeaning model_attributes[] = {
    {"format", "`palpate`"},
    {"version",
     "two integers: major, minor. Another major version is refused (\"precompute it again\"); a newer minor "
     "version is read and what it adds is ignored"},
    {"generator", "program and version that wrote the file"},
    {"units", "`m, N, Pa, kg, s`"},
    {"scalar",
     "`float32`, `float32+smooth` (split precision) or `float64`: the type of `/greens/packed` and "
     "`/dynamics/inverse`, and whether a smooth part belongs to them. Readers of versions before 3.3 do not "
     "know the second and refuse such a file"},
    {"name", "name of the model"},
    {"element", "kind of all elements: `tri3`, `quad4` (in the plane), `tet4`, `tet10` or `hex8` (in space)"},
    {"dimension", "*d*: 2 or 3, as the elements have it; a node has as many dofs"},
    {"analysis", "`solid` in space, `plane_stress` or `plane_strain` in the plane"},
    {"scope",
     "`surface`, `layers`, `full` or `none`: which nodes are stored. With `none` there are no Green's "
     "functions and no probes; readers of versions before 3.5 refuse such a file"},
    {"layers", "element layers below the surface that are stored; 0 unless `scope` is `layers`"},
    {"content_hash", "one hash of everything, see [checksums](../file-format.md#checksums)"}};

constexpr FieldMeaning model_fields[] = {
    {"/mesh/nodes", "positions [m]"},
    {"/mesh/connectivity",
     "nodes of the elements, one element after another, numbered as VTK does, positively oriented"},
    {"/mesh/offsets", "0, *k*, 2 *k*, ...: where each element starts in `connectivity`"},
    {"/mesh/types", "VTK's number of the kind: 5 tri3, 9 quad4, 10 tet4, 24 tet10, 12 hex8"},
    {"/mesh/regions", "region tag of each element, 0 where the source has none"},
    {"/mesh/surface",
     "nodes of triangles, counter-clockwise seen from outside; in the plane of lines, with the body on their "
     "left. Sides with more nodes are cut into triangles"},
    {"/dofs/fixed", "bit 0, 1, 2 is set where the node is held along x, y, z"},
    {"/dofs/stored_nodes",
     "mesh node of each stored node; stored dof *d s* + axis belongs to stored node *s*. Of a node that is "
     "held along some axes only, the rows and columns of the held dofs are zero"},
    {"/material/isotropic", "Young's modulus [Pa], Poisson's ratio, density [kg/m³]; one row per material"},
    {"/material/friction", "Coulomb's coefficient between the material's surface and a tool"},
    {"/material/initial_strain",
     "strain of the stress-free material: xx, yy, zz, xy, yz, zx (engineering shear)"},
    {"/material/of_element", "row of the three above that each element is made of"},
    {"/material/thickness", "in the plane [m]; 1 in space"},
    {"/rest/force", "nodal forces of the loads, which act all the time [N]"},
    {"/rest/displacement",
     "of the body at rest: by the loads, and as prescribed where it is held [m]. Touches displace from "
     "there"},
    {"/quality/summary",
     "smallest and largest angle [degree] (dihedral; in the plane of the corners), smallest and mean shape "
     "(radius ratio of simplices, scaled Jacobian of quad4 and hex8), shortest and longest edge [m], volume "
     "[m³] (in the plane area [m²]), element with the smallest shape, its centroid x, y, z [m]"},
    {"/quality/angle_histogram", "the angles in bins of 10 degrees"},
    {"/model_toml", "the description, byte for byte"},
    {"/provenance/sources",
     "one line per source file: role, bytes, XXH3-128, path from this file's folder; separated by one space"},
    {"/VTKHDF/NumberOfPoints", "*N*, for VTK"},
    {"/VTKHDF/NumberOfCells", "*E*, for VTK"},
    {"/VTKHDF/NumberOfConnectivityIds", "*k E*, for VTK"},
    {"/overlay/refinement", "each element of an overlay is cut into this number to the power of *d*"},
    {"/overlay/rings", "rings of elements that an overlay reaches"},
    {"/overlay/centres", "mesh nodes that the overlays are centred on, ascending"},
    {"/overlay/nodes", "*g* of each overlay: nodes of the body in it that can move"},
    {"/overlay/surface_nodes", "*q* of each overlay: nodes of its fine mesh on the surface"},
    {"/overlay/surface", "their numbers in the fine mesh, ascending in each overlay"},
    {"/overlay/G",
     "what each fine mesh softens the body by, K_GL K_L⁻¹ K_LG [N/m]: lower triangles column by column, one "
     "overlay after another"},
    {"/overlay/T", "displacement of the surface's nodes by that of the body's nodes; row by row"},
    {"/overlay/compliance", "K_L⁻¹ on the surface's nodes [m/N]: lower triangles"},
    {"/warp/nodes", "mesh nodes on the surface that shared the force, ascending"},
    {"/warp/direction", "of the force at rest, of length 1; it turned with the nodes"},
    {"/warp/force", "size of the force at each level, ascending [N]"},
    {"/warp/rotation",
     "largest rotation of a surface triangle (in the plane, line) of the corotational body, ascending [rad]"},
    {"/warp/linear",
     "errors of small strain, of the corotational body's: of the force that moves the nodes as far (with its "
     "sign; infinity: none does), and of their mean displacement under the same force"},
    {"/warp/warped", "errors of the warped body, likewise; infinity where no balance was found"},
    {"/greens/packed",
     "Green's functions Ξ of the stored dofs [m/N]: lower triangle, column by column from the diagonal down "
     "(LAPACK `uplo = 'L'`); starts at a multiple of 4096 bytes. In split precision the remainder R"},
    {"/greens/smooth", "split precision: W, 1 ≤ *w* ≤ 256; Ξ = R + W Wᵀ. Rows of held dofs are 0"},
    {"/greens/force_error",
     "force errors that were measured in single, split and double precision; −1: not measured; infinity: C "
     "is "
     "not positive definite. From 3.3 on"},
    {"/greens/levels",
     "compressed, as all that follows to `/greens/couplings` (from 3.4 on): L, the leaves of the tree of "
     "clusters are on this level. Cluster *i* of level *l* is number 2^*l* − 1 + *i* and has the stored "
     "nodes "
     "⌊*i S* / 2^*l*⌋ to ⌊(*i* + 1) *S* / 2^*l*⌋ − 1"},
    {"/greens/tolerance", "most that forces of touches may be off, relative to the largest"},
    {"/greens/near_pairs", "leaves, row and column, row ≥ column; by columns, then rows"},
    {"/greens/far_pairs", "clusters of one level, row and column, row > column; by columns, then rows"},
    {"/greens/ranks", "columns of V of each cluster"},
    {"/greens/pair_errors",
     "by how much each far pair is off, about: Frobenius' norm of L⁻¹ (Ξ − stored) L⁻ᵀ, with L Lᵀ = Ξ of the "
     "leaves (theory, section 2.3)"},
    {"/greens/certificate",
     "measured when the file was written: nodes of a touch, touches, the median, 99 % and largest of their "
     "force errors, and the largest share that total forces' errors have of a tick's bound"},
    {"/greens/near",
     "blocks of Ξ of the near pairs [m/N], one after another, by rows; starts at a multiple of 4096 bytes"},
    {"/greens/bases", "V of the leaves, one after another, by rows"},
    {"/greens/transfers",
     "E of the clusters, one after another, by rows: V of a parent is V E of its children, one under the "
     "other"},
    {"/greens/couplings", "S of the far pairs [m/N], one after another, by rows: their block of Ξ is V S Vᵀ"},
    {"/dynamics/method", "1 packed, 2 modal"},
    {"/dynamics/lumped", "1 where M is diagonal"},
    {"/dynamics/newmark", "α, δ and Δt [s]"},
    {"/dynamics/damping", "a [1/s] and b [s] of C_d = a M + b K"},
    {"/dynamics/matrices/start",
     "packed: first entry of each column of the lower triangle of M and C_d of the stored dofs; held dofs "
     "have "
     "no entries"},
    {"/dynamics/matrices/row", "packed: row of each entry, ascending in a column from the diagonal down"},
    {"/dynamics/matrices/mass", "packed: entries of M [kg]"},
    {"/dynamics/matrices/damping", "packed: entries of C_d [N s/m]"},
    {"/dynamics/inverse",
     "packed: (K + a₀ M + a₁ C_d)⁻¹ of the stored dofs [m/N], a₀ = 1/(α Δt²), a₁ = δ/(α Δt); numbered and "
     "stored as `/greens/packed`"},
    {"/dynamics/smooth", "packed, in split precision: W of the inverse"},
    {"/dynamics/force_error", "packed: force errors of the inverse, as `/greens/force_error`"},
    {"/dynamics/modes/omega",
     "modal: angular frequencies, ascending [rad/s]; the last is that of the first mode that is not kept, "
     "infinity when all are"},
    {"/dynamics/modes/shapes",
     "modal: the modes at the stored dofs, φᵀMφ = 1 over the whole body [1/√kg]; 0 at held dofs"},
    {"/probes/forces", "forces on the stored dofs [N] ..."},
    {"/probes/displacements", "... and the displacements that they must give [m]"}};

constexpr FieldMeaning recording_attributes[] = {
    {"format", "`palpate-recording`"},     {"generator", "program and version that recorded"},
    {"units", "of the datasets"},          {"model", "path of the model"},
    {"content_hash", "that of the model"}, {"device", "the input source"},
    {"rate", "ticks per second"},          {"options", "lines `name=value`, such as `overlay=r=3,rings=2`"}};

}  // namespace

std::span<const FieldMeaning> model_attribute_meanings() {
  return model_attributes;
}
std::span<const FieldMeaning> model_field_meanings() {
  return model_fields;
}
std::span<const FieldMeaning> recording_attribute_meanings() {
  return recording_attributes;
}

}  // namespace palpate
