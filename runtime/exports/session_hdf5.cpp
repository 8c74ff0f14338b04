#include "runtime/exports/session_hdf5.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "formats/contents.h"
#include "formats/recording_messages.h"
#include "formats/writer/hdf5_file.h"

namespace palpate {
namespace {

constexpr std::int64_t block = 8192;  // ticks written at a time
constexpr const char* units = "s, m, m/s, N, N m, N/m, Pa; names with _ns in ns";

template <class T>
void write(hdf5::File& file, const char* name, const std::vector<std::int64_t>& dims,
           const std::vector<T>& values) {
  file.write(name, number_type<T>(), dims, values.data());
}

void write_head(hdf5::File& file, const RecordingFile& recording) {
  const SessionInfo& info = recording.info();
  file.write_attribute("/", "format", "palpate-recording");
  file.write_attribute("/", "generator", recording.generator());
  file.write_attribute("/", "units", units);
  file.write_attribute("/", "model", info.model_path);
  file.write_attribute("/", "content_hash", info.content_hash);
  file.write_attribute("/", "device", info.device);
  file.write_attribute("/", "rate", std::array{info.rate});
  file.write_attribute("/", "options", info.options);
  const RecordedSurface& surface = recording.surface();
  std::vector<double> nodes;
  for (const Vec3& node : surface.nodes) nodes.insert(nodes.end(), node.begin(), node.end());
  std::vector<std::uint8_t> held = surface.held;
  held.resize(surface.nodes.size());
  write(file, "/surface/nodes", {std::ssize(surface.nodes), 3}, nodes);
  write(file, "/surface/simplices", {std::ssize(surface.simplices) / surface.corners, surface.corners},
        surface.simplices);
  write(file, "/surface/held", {std::ssize(held)}, held);
}

/// Field of a tick as a dataset: /ticks/NAME, with a row of `components` numbers for each tick.
struct TickColumn {
  std::string name;
  NumberType type;
  std::int64_t components = 1;
  std::size_t offset = 0;  ///< offset of the numbers in TickRecord [byte]

  [[nodiscard]] std::size_t bytes() const { return type.bytes * static_cast<std::size_t>(components); }
};

/// Collects the layout of a tick's fields.
class ColumnFinder {
 public:
  explicit ColumnFinder(const TickRecord& tick) : begin_(reinterpret_cast<const std::byte*>(&tick)) {}

  template <class T>
  void number(const char*, const char* name, const T& member) {
    add(name, &member, 1);
  }
  void vector(const char* name, const double (&member)[3]) { add(name, member, 3); }
  void numbers(const char* name, const double (&member)[6]) { add(name, member, 6); }
  void pose(const std::string& name, const double (&position)[3], const double (&orientation)[4]) {
    add(name + "_position", position, 3);
    add(name + "_orientation", orientation, 4);
  }
  void wrench(std::string_view name, const double (&force)[3], const double (&torque)[3]) {
    const std::string before = name == "wrench" ? "" : std::string(name) + "_";
    add(before + "force", force, 3);
    add(before + "torque", torque, 3);
  }

  std::vector<TickColumn> columns;

 private:
  template <class T>
  void add(const std::string& name, const T* member, std::int64_t components) {
    const std::byte* at = reinterpret_cast<const std::byte*>(member);
    columns.push_back({name, number_type<T>(), components, static_cast<std::size_t>(at - begin_)});
  }

  const std::byte* begin_;
};

void write_ticks(hdf5::File& file, const RecordingFile& recording, TickRange ticks) {
  const TickRecord tick;
  ColumnFinder finder(tick);
  for_each_tick_field(tick, finder);
  const std::vector<TickColumn>& columns = finder.columns;  // in the order of the message
  for (const TickColumn& column : columns) {
    std::vector<std::int64_t> dims = {ticks.end - ticks.begin};
    if (column.components > 1) dims.push_back(column.components);
    file.write("/ticks/" + column.name, column.type, dims, nullptr);
  }
  std::vector<TickRecord> some;
  std::vector<std::byte> values;
  for (std::int64_t row = ticks.begin; row < ticks.end; row += std::ssize(some)) {
    some.clear();
    for (std::int64_t k = row; k < std::min(row + block, ticks.end); ++k) some.push_back(recording.tick(k));
    for (const TickColumn& column : columns) {
      values.resize(some.size() * column.bytes());
      for (std::size_t k = 0; k < some.size(); ++k)
        std::memcpy(&values[k * column.bytes()], reinterpret_cast<const std::byte*>(&some[k]) + column.offset,
                    column.bytes());
      file.write_rows("/ticks/" + column.name, column.type, row - ticks.begin, std::ssize(some),
                      values.data());
    }
  }
}

void reserve_frames(hdf5::File& file, std::int64_t pictures, std::int64_t nodes) {
  const NumberType number = number_type<float>();
  file.write("/frames/tick", number_type<std::int64_t>(), std::array{pictures}, nullptr);
  file.write("/frames/time", number_type<double>(), std::array{pictures}, nullptr);
  file.write("/frames/displacement", number, std::array{pictures, nodes, std::int64_t{3}}, nullptr);
  file.write("/frames/von_mises", number, std::array{pictures, nodes}, nullptr);
  file.write("/frames/pressure", number, std::array{pictures, nodes}, nullptr);
}

}  // namespace

void write_hdf5(const std::filesystem::path& file, const RecordingFile& recording, TickRange ticks,
                std::int64_t pictures) {
  const hdf5::Quiet quiet;
  hdf5::File out = hdf5::File::create(file);
  write_head(out, recording);
  write_ticks(out, recording, ticks);
  reserve_frames(out, pictures, std::ssize(recording.surface().nodes));
  out.close();
}

}  // namespace palpate
