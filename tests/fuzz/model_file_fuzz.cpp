// libFuzzer target: whatever lies in a file, load_model either throws Error or returns a model that the tick
// can trust.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <set>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "formats/writer/hdf5.h"
#include "matrices/hierarchical_product.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test {
namespace {

struct Good {
  Folder folder;
  std::filesystem::path path = folder / "x.palpate.hdf";
  std::string bytes;
  std::vector<std::string> datasets;
  std::vector<std::string> attributes = {"format", "version",   "units", "element", "dimension", "analysis",
                                         "scalar", "generator", "name",  "scope",   "layers",    "new"};
  explicit Good(ElementType element) {
    write_sample(path, Precision::double_precision, element, 1);
    bytes = read_bytes(path);
    datasets = checked_datasets(path);
    datasets.emplace_back("/mesh/new");
  }
};

void require(bool condition) {
  if (!condition) std::abort();
}

/// All values in [0, below).
bool indices(const std::vector<Index>& values, std::size_t below) {
  return std::all_of(values.begin(), values.end(),
                     [below](Index i) { return i >= 0 && static_cast<std::size_t>(i) < below; });
}

bool finite(const std::vector<Vec3>& rows, const Model& model) {
  return rows.size() == model.mesh.nodes.size() &&
         std::all_of(rows.begin(), rows.end(), [&model](const Vec3& row) {
           return row.allFinite() && (model.dimension() == 3 || row.z() == 0.0);
         });
}

/// Reads every entry, by rows and by a load on all nodes.
void use_compressed(const HierarchicalMatrix& matrix, std::int64_t order) {
  require(order > 0 && matrix.order() == order);
  std::vector<Index> nodes(static_cast<std::size_t>(matrix.tree.nodes));
  std::iota(nodes.begin(), nodes.end(), 0);
  std::vector<double> row(static_cast<std::size_t>(matrix.dimension * order)),
      f(static_cast<std::size_t>(order)), u(f.size());
  for (const Index node : nodes) gather_blocks(matrix, node, nodes, row);
  const NodeRange all{0, matrix.tree.nodes};
  displace(matrix, nodes, f, {&all, 1}, u);
}

/// What the runtime takes for granted.
void use(const Model& model) {
  const std::size_t nodes = model.mesh.nodes.size();
  const auto elements = static_cast<std::size_t>(model.mesh.elements());
  const auto d = static_cast<std::size_t>(model.dimension());
  require((d == 2 || d == 3) && (model.analysis == Analysis::solid) == (d == 3));
  require(model.fixed.size() == nodes && model.mesh.regions.size() == elements && elements > 0);
  require(finite(model.mesh.nodes, model) && finite(model.rest_force, model) &&
          finite(model.rest_displacement, model));
  require(model.mesh.connectivity.size() ==
          elements * static_cast<std::size_t>(traits(model.mesh.element).nodes));
  require(indices(model.mesh.connectivity, nodes) && indices(model.surface, nodes) &&
          model.surface.size() % d == 0);
  require(model.material_of_element.size() == elements &&
          indices(model.material_of_element, model.materials.size()));
  for (const Material& m : model.materials)
    require(m.youngs_modulus > 0 && m.poissons_ratio < 0.5 && m.density > 0 && m.friction >= 0);
  require(model.thickness > 0 && std::isfinite(model.thickness));
  for (const std::uint8_t mask : model.fixed) require(mask < (1U << d));
  require(indices(model.stored_nodes, nodes));
  std::set<Index> stored;
  for (const Index node : model.stored_nodes)
    require(model.fixed[static_cast<std::size_t>(node)] != (1U << d) - 1 && stored.insert(node).second);
  if (model.compressed != nullptr) {
    use_compressed(*model.compressed, model.stored_dofs());
    return;
  }
  require(!stored.empty() && model.greens.order() == model.stored_dofs());
  for (std::int64_t i = 0; i < model.greens.order(); ++i) {
    require(model.greens(i, i) >= 0);
    for (std::int64_t j = 0; j <= i; ++j) require(std::isfinite(model.greens(i, j)));
  }
  for (const Probe& probe : model.probes)
    require(static_cast<std::int64_t>(probe.force.size()) == model.stored_dofs() &&
            probe.displacement.size() == probe.force.size());
}

/// Sizes near those of the file, and some that nobody can hold.
std::vector<hsize_t> some_dims(FuzzedDataProvider& choose) {
  std::vector<hsize_t> dims(choose.ConsumeIntegralInRange<std::size_t>(0, 5));
  for (hsize_t& dim : dims)
    dim = choose.ConsumeBool() ? choose.ConsumeIntegralInRange<hsize_t>(0, 100)
                               : choose.ConsumeIntegral<std::uint32_t>();
  return dims;
}

void edit(const Good& good, FuzzedDataProvider& choose) {
  const auto dataset = [&] {
    return good.datasets[choose.ConsumeIntegralInRange<std::size_t>(0, good.datasets.size() - 1)];
  };
  const auto attribute = [&] {
    return good.attributes[choose.ConsumeIntegralInRange<std::size_t>(0, good.attributes.size() - 1)];
  };
  switch (choose.ConsumeIntegralInRange<int>(0, 9)) {
    case 0:
      remove_object(good.path, dataset());
      break;
    case 1: {
      const hid_t types[] = {H5T_STD_U8LE,   H5T_STD_I32LE,  H5T_STD_I64LE,
                             H5T_IEEE_F32LE, H5T_IEEE_F64LE, H5T_IEEE_F64BE};
      const auto type = types[choose.ConsumeIntegralInRange<std::size_t>(0, std::size(types) - 1)];
      const std::string name = dataset();
      replace(good.path, name, type, some_dims(choose));
      break;
    }
    case 2:
      replace_by_soft_link(good.path, dataset(), dataset());
      break;
    case 3:
      set_text(good.path, attribute(), choose.ConsumeRandomLengthString(40));
      break;
    case 4: {
      std::vector<std::int64_t> values(choose.ConsumeIntegralInRange<std::size_t>(1, 3));
      for (std::int64_t& value : values) value = choose.ConsumeIntegral<std::int64_t>();
      set_integers(good.path, attribute(), values);
      break;
    }
    case 5:
      remove_attribute(good.path, "/", attribute());
      break;
    default: {
      const std::string name = dataset();
      const auto at = choose.ConsumeIntegralInRange<std::uint64_t>(0, 4096);
      const auto bytes = choose.ConsumeBytes<std::uint8_t>(choose.ConsumeIntegralInRange<std::size_t>(1, 8));
      set_bytes(good.path, name, at, bytes.data(), bytes.size());
    }
  }
}

}  // namespace
}  // namespace palpate::test

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate;
  using namespace palpate::test;
  static const Good solid(ElementType::tet4), plane(ElementType::quad4);
  if (size == 0) return 0;
  const Good& good = data[0] == some_plane_edits ? plane : solid;
  const hdf5::Quiet quiet;
  if (data[0] == raw_file) {
    write_bytes(good.path, std::string(data + 1, data + size));
  } else {
    write_bytes(good.path, good.bytes);
    FuzzedDataProvider choose(data + 1, size - 1);
    try {
      for (int edits = 0; edits < 6 && choose.remaining_bytes() > 0; ++edits) edit(good, choose);
      reseal(good.path);
    } catch (const std::runtime_error&) {
      return 0;  // HDF5 itself does not make such a file
    }
  }
  try {
    use(load_model(good.path));
  } catch (const Error& error) {
    require(!std::string(error.what()).empty() && !error.where().empty() && !error.hint().empty());
  }
  return 0;
}
