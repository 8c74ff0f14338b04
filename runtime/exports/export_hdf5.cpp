// palpate-export-hdf5: the part of `palpate-runtime export --hdf5` that needs the HDF5 library.
#include <charconv>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/program.h"
#include "formats/recording.h"
#include "runtime/exports/session_hdf5.h"

namespace {

/// Parses a number; -1 if the text is not one.
std::int64_t number_of(std::string_view text) {
  std::int64_t number = -1;
  const auto [end, bad] = std::from_chars(text.data(), text.data() + text.size(), number);
  return bad == std::errc() && end == text.data() + text.size() ? number : -1;
}

}  // namespace

int main(int argc, char** argv) {
  return palpate::run_program("palpate-export-hdf5", "export less, by --from and --to", [&] {
    const std::span arguments(argv, static_cast<std::size_t>(argc));
    if (argc != 6) {
      return palpate::tell_usage(
          "RECORDING, OUTPUT, first tick, end of ticks and number of pictures are required",
          "palpate-runtime export RECORDING --hdf5 OUTPUT runs this program");
    }
    const palpate::RecordingFile recording(arguments[1]);
    const palpate::TickRange ticks{number_of(arguments[3]), number_of(arguments[4])};
    const std::int64_t pictures = number_of(arguments[5]);
    if (ticks.begin < 0 || ticks.end < ticks.begin || ticks.end > recording.ticks() || pictures < 0)
      throw palpate::Error("has no such ticks", arguments[1], "palpate-runtime session tells how long it is");
    palpate::write_hdf5(arguments[2], recording, ticks, pictures);
    return static_cast<int>(palpate::exit_ok);
  });
}
