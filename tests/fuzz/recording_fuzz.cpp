// libFuzzer target: whatever lies in a file, RecordingFile either throws Error or gives ticks, contacts and
// pictures that fit the surface. CRCs are made right first, so that what is behind them is met.
#include <zlib.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "base/error.h"
#include "formats/recording.h"
#include "tests/support/files/formats_sample.h"

namespace palpate::test {
namespace {

constexpr std::size_t head = 9, chunk_head = 40;  // of a record, of a chunk before its records
constexpr char chunk_code = 6;

void reseal(std::string& bytes) {
  for (std::size_t at = 8; at + head <= bytes.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof length);
    if (length > bytes.size() - at - head) return;
    if (bytes[at] == chunk_code && length >= chunk_head) {
      const auto* records = reinterpret_cast<const Bytef*>(bytes.data()) + at + head + chunk_head;
      const auto crc = static_cast<std::uint32_t>(crc32_z(0, records, length - chunk_head));
      std::memcpy(bytes.data() + at + head + 24, &crc, sizeof crc);
    }
    at += head + length;
  }
}

void require(bool condition) {
  if (!condition) std::abort();
}

/// What views, replays and exports take for granted.
void use(const RecordingFile& file) {
  const std::size_t nodes = file.surface().nodes.size();
  require(file.surface().held.size() == nodes && file.info().rate > 0);
  double before = -1.0;
  for (std::int64_t row = 0; row < file.ticks(); ++row) {
    const double time = file.tick(row).time;
    require(time > before && std::isfinite(time));
    before = time;
  }
  for (std::int64_t k = 0; k < std::ssize(file.pictures()); ++k) {
    if (file.stores_pictures()) {
      const SurfaceFrame frame = file.frame(k);
      require(frame.displacement.size() == 3 * nodes && frame.pressure.size() == nodes);
    } else {
      const ContactLoads loads = file.loads(k);
      require(loads.force.size() == 3 * loads.node.size() && loads.press.size() == loads.node.size());
      for (const Index node : loads.node) require(node >= 0 && static_cast<std::size_t>(node) < nodes);
    }
  }
}

}  // namespace
}  // namespace palpate::test

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate;
  static const test::Folder folder;
  static const std::filesystem::path path = folder / "x.mcap";
  std::string bytes(reinterpret_cast<const char*>(data), size);
  test::reseal(bytes);
  test::write_bytes(path, bytes);
  try {
    test::use(RecordingFile(path));
    (void)finish_recording(path);
    test::use(RecordingFile(path));
  } catch (const Error&) {  // as it should be
  }
  return 0;
}
