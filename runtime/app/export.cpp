#include "runtime/app/export.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/file_io.h"
#include "base/json_text.h"
#include "base/program.h"
#include "base/words.h"
#include "base/write_file.h"
#include "formats/contents.h"
#include "formats/outputs/output_paths.h"
#include "formats/recording.h"
#include "runtime/app/session_pictures.h"
#include "runtime/exports/gltf.h"
#include "runtime/exports/session_hdf5.h"
#include "runtime/exports/session_xdmf.h"
#include "runtime/exports/ticks_table.h"
#include "runtime/loop/session_check.h"
#include "runtime/push/other_program.h"
#include "runtime/scene/seen_surface.h"
#include "runtime/viewer/page_archive.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/wire.h"
#include "runtime/web/page.h"

namespace palpate {
namespace {

/// Interval of complete pictures in a page; it seeks from the last complete one.
constexpr std::size_t pictures_per_whole = 30;

constexpr std::size_t most_page_bytes = std::size_t{1} << 29U;  // before compression

/// Limit of pictures in a glTF scene: each is a morph target with a weight at the time of each picture.
constexpr std::size_t most_targets = 1000;
constexpr std::size_t most_scene_bytes = std::size_t{1} << 30U;  // the format ends at 4 GiB

constexpr double usual_fps = 30.0;
constexpr std::size_t table_block = 1 << 20;  // bytes written at a time

/// Returns the numbers of the exported pictures, at most `fps` per second.
std::vector<std::int64_t> choose(const SessionPictures& pictures, const ExportOptions& options, double fps) {
  std::vector<std::int64_t> chosen;
  const double spacing = (1.0 - 1e-6) / fps;
  for (std::int64_t k = 0; k < pictures.frames(); ++k) {
    const double time = pictures.time(k);
    if (time < options.from || (options.to && time > *options.to)) continue;
    if (chosen.empty() || time - pictures.time(chosen.back()) >= spacing) chosen.push_back(k);
  }
  return chosen;
}

void expect_some(const std::vector<std::int64_t>& chosen, const SessionPictures& pictures,
                 const ExportOptions& options) {
  if (!chosen.empty()) return;
  throw Error(
      fmt::format("has no pictures from {:g} s on{}", options.from,
                  options.to ? fmt::format(" to {:g} s", *options.to) : ""),
      options.recording.string(),
      fmt::format("it lasts from {:g} to {:g} s", pictures.time(0), pictures.time(pictures.frames() - 1)));
}

/// Exported pictures of a recording.
struct Chosen {
  SessionPictures& pictures;
  std::vector<std::int64_t> frames;

  [[nodiscard]] double seconds() const {
    return pictures.time(frames.back()) - pictures.time(frames.front());
  }
  [[nodiscard]] SurfacePicture picture(std::size_t k) const { return pictures.picture(frames[k]); }
};

/// Refuses an export too large for its format, with a hint to export it in parts.
[[noreturn]] void refuse(const std::string& what, const ExportOptions& options, const std::string& most) {
  throw Error(what, options.recording.string(),
              "ask for at most " + most + " by a lower --fps, or a part by --from and --to");
}

std::string html_page(const Chosen& chosen, const ExportOptions& options) {
  const SessionPictures& pictures = chosen.pictures;
  std::vector<double> times;
  times.reserve(chosen.frames.size());
  for (const std::int64_t frame : chosen.frames) times.push_back(pictures.time(frame));

  PageArchive archive;
  archive.add_text(hello_word("file", 0));
  const Scene scene = pictures.scene();
  const StateWord state(json_text(pictures.state(times)));
  archive.add_text(state.for_page(scene.number, {}, state.times()));
  archive.add_binary(encode_scene(scene));
  for (const TickRun& run : pictures.ticks())
    archive.add_binary(encode_ticks(scene.number, run.notes, run.stride));
  std::optional<WireValues> base;
  for (std::size_t k = 0; k < chosen.frames.size(); ++k) {
    if (archive.bytes() > most_page_bytes)
      refuse(fmt::format("a page of {} pictures is too large for a browser", chosen.frames.size()), options,
             fmt::format("{} pictures", k));
    const SurfacePicture picture = chosen.picture(k);
    WireValues values = wire_values(picture, scene, nullptr, static_cast<std::uint32_t>(k + 1));
    const bool is_whole = k % pictures_per_whole == 0;
    archive.add_binary(encode_frame(picture, scene, nullptr, values, is_whole ? nullptr : &*base));
    base = std::move(values);
  }
  return archive.page(viewer_page());
}

void tell(const std::filesystem::path& file, const Chosen& chosen, std::size_t bytes) {
  say(stderr, "{}: {} pictures, {:.1f} s, {:.1f} MB\n", file, chosen.frames.size(), chosen.seconds(),
      1e-6 * static_cast<double>(bytes));
}

/// File name of a frame: "00042.vtu".
std::string frame_name(std::size_t number) {
  return fmt::format("{:05}.vtu", number);
}

/// Folder for the pictures of a series, beside the collection.
std::filesystem::path frames_folder(const std::filesystem::path& pvd) {
  std::filesystem::path folder = pvd;
  return folder.replace_extension(".frames");
}

/// Throws Error if the folder is a file, or has files that are not from an earlier series.
void expect_only_frames(const std::filesystem::path& folder, bool force) {
  if (!std::filesystem::exists(folder)) return;
  if (!std::filesystem::is_directory(folder))
    throw Error("is a file, where the pictures' folder is to be", folder.string(), "name another --vtu file");
  if (force) return;
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++count;
  for (std::size_t k = 0; k < count; ++k) {
    if (!std::filesystem::exists(folder / frame_name(k)))
      throw Error("has files that are no pictures of a series", folder.string(),
                  "name another file, or give --force to put the pictures beside them");
  }
}

/// Writes the pictures, and the collection (.pvd) that lists them with their times. Returns the total size of
/// the pictures [byte].
std::size_t write_series(const std::filesystem::path& pvd, const Chosen& chosen) {
  const std::filesystem::path folder = frames_folder(pvd);
  const Scene scene = chosen.pictures.scene();
  std::error_code reason;
  std::filesystem::create_directory(folder, reason);
  if (reason) throw Error("cannot be made: " + reason.message(), folder.string(), "write elsewhere");
  FileWriter collection(pvd);
  collection.write("<?xml version=\"1.0\"?>\n<!-- palpate " PALPATE_VERSION
                   " -->\n<VTKFile type=\"Collection\" "
                   "version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n");
  std::size_t bytes = 0;
  for (std::size_t k = 0; k < chosen.frames.size(); ++k) {
    const SurfacePicture picture = chosen.picture(k);
    const std::string text = surface_vtu(picture, scene, nullptr);
    write_file(folder / frame_name(k), text);
    bytes += text.size();
    collection.write(fmt::format("<DataSet timestep=\"{}\" file=\"{}\"/>\n", picture.frame.time,
                                 xml_escaped((folder.filename() / frame_name(k)).string())));
  }
  for (std::size_t k = chosen.frames.size(); std::filesystem::remove(folder / frame_name(k)); ++k) {
  }  // left over from a longer series
  collection.write("</Collection>\n</VTKFile>\n");
  collection.finish();
  return bytes;
}

/// Returns the ticks from options.from to options.to, at least one.
TickRange choose_ticks(const RecordingFile& recording, const ExportOptions& options) {
  const auto first_from = [&](auto&& is_before) {  // by bisection
    std::int64_t low = 0, high = recording.ticks();
    while (low < high) {
      const std::int64_t middle = low + (high - low) / 2;
      if (is_before(recording.tick(middle).time)) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  };
  const TickRange chosen{
      first_from([&](double time) { return time < options.from; }),
      options.to ? first_from([&](double time) { return time <= *options.to; }) : recording.ticks()};
  if (chosen.begin >= chosen.end)
    throw Error("has no ticks in that time", options.recording.string(),
                "palpate-runtime session tells how long it is");
  return chosen;
}

void write_table(const RecordingFile& recording, const ExportOptions& options,
                 const std::filesystem::path& csv) {
  const TickRange ticks = choose_ticks(recording, options);
  FileWriter table(csv);
  std::string text(ticks_header);
  for (std::int64_t row = ticks.begin; row < ticks.end; ++row) {
    text += ticks_line(recording.tick(row));
    if (text.size() < table_block && row + 1 < ticks.end) continue;
    table.write(text);
    text.clear();
  }
  table.finish();
  say(stderr, "{}: {} ticks\n", options.csv, ticks.end - ticks.begin);
}

void write_scene(const Chosen& chosen, const ExportOptions& options, const std::filesystem::path& gltf) {
  const SessionPictures& pictures = chosen.pictures;
  const std::size_t count = chosen.frames.size();
  const std::size_t each = std::max<std::size_t>(glb_bytes(pictures.surface(), 1) / 2, 1);
  const std::size_t most = std::min(most_targets, most_scene_bytes / each);
  if (count > most)
    refuse(fmt::format("{} pictures were asked for as glTF", count), options, fmt::format("{}", most));
  FileWriter file(gltf);
  write_glb(file, pictures.name(), pictures.surface(), pictures.tool(), count,
            [&](std::size_t k) { return chosen.picture(k); });
  file.finish();
  tell(options.gltf, chosen, file.bytes());
}

/// Writes a row into an allocated dataset.
template <class T>
void fill(const Contents& file, const std::string& dataset, std::size_t rank, std::int64_t row,
          std::span<const T> values) {
  const Stored space = file.locate(dataset, number_type<T>(), rank);
  write_exactly(file.file(), std::as_bytes(values),
                space.offset + row * static_cast<std::int64_t>(values.size_bytes()));
}

void fill_frame(const Contents& file, std::int64_t row, const SurfaceFrame& frame) {
  fill<std::int64_t>(file, "/frames/tick", 1, row, std::array{frame.tick});
  fill<double>(file, "/frames/time", 1, row, std::array{frame.time});
  fill<float>(file, "/frames/displacement", 3, row, frame.displacement);
  fill<float>(file, "/frames/von_mises", 2, row, frame.von_mises);
  fill<float>(file, "/frames/pressure", 2, row, frame.pressure);
}

/// Writes ticks and, if there are any, pictures with their description. The HDF5 library and its dependencies
/// are in a program of its own, which allocates the space for the pictures.
void write_numbers(const RecordingFile& recording, SessionPictures* pictures, const ExportOptions& options,
                   const std::filesystem::path& hdf5) {
  const TickRange ticks = choose_ticks(recording, options);
  std::vector<std::int64_t> frames;
  if (pictures != nullptr)
    frames = choose(*pictures, options, options.fps.value_or(std::numeric_limits<double>::infinity()));
  TemporaryFile made(hdf5);
  const ProgramEnd end =
      run_other_program(find_program("palpate-export-hdf5"),
                        {options.recording.string(), made.path().string(), std::to_string(ticks.begin),
                         std::to_string(ticks.end), std::to_string(frames.size())});
  if (end.status != exit_ok)
    throw Error(fmt::format("palpate-export-hdf5 ended with status {}", end.status), hdf5.string(),
                "see what it says above");
  const Contents file = Contents::read(open_file(made.path(), OpenMode::write));
  std::vector<double> times;
  for (const std::int64_t k : frames) {
    SurfaceFrame frame = pictures->picture(k).frame;
    const PictureTime& taken = recording.pictures()[static_cast<std::size_t>(k)];
    frame.tick = taken.tick;
    frame.time = taken.time;
    fill_frame(file, std::ssize(times), frame);
    times.push_back(taken.time);
  }
  made.take_its_place();
  if (frames.empty()) {
    std::filesystem::remove(xdmf_path(hdf5));  // left over from an earlier export
  } else {
    write_xdmf(hdf5, recording.surface(), times);
  }
  say(stderr, "{}: {} ticks, {} pictures\n", options.hdf5, ticks.end - ticks.begin, frames.size());
}

}  // namespace

int export_session(const ExportOptions& options) {
  OutputPaths paths(options.force);
  paths.add_input(options.recording, "the recording");
  const auto output = [&](const std::filesystem::path& file, OutputKind kind, const char* option) {
    return file.empty() ? file : paths.add(file, kind, option);
  };
  const std::filesystem::path html = output(options.html, OutputKind::page, "--html"),
                              gltf = output(options.gltf, OutputKind::scene, "--gltf"),
                              vtu = output(options.vtu, OutputKind::series, "--vtu"),
                              csv = output(options.csv, OutputKind::ticks, "--csv"),
                              hdf5 = output(options.hdf5, OutputKind::hdf5, "--hdf5");
  if (!hdf5.empty()) paths.add(xdmf_path(hdf5), OutputKind::frames, "--hdf5");
  if (!vtu.empty()) expect_only_frames(frames_folder(vtu), options.force);

  const RecordingFile recording = open_session(options.recording);
  if (!csv.empty()) write_table(recording, options, csv);
  const bool shows = !html.empty() || !gltf.empty() || !vtu.empty();
  std::optional<SessionPictures> pictures;
  if (shows || (!hdf5.empty() && !recording.pictures().empty())) pictures.emplace(options.recording);
  if (!hdf5.empty()) write_numbers(recording, pictures ? &*pictures : nullptr, options, hdf5);
  if (!shows) return exit_ok;
  const Chosen chosen{*pictures, choose(*pictures, options, options.fps.value_or(usual_fps))};
  expect_some(chosen.frames, *pictures, options);
  if (!html.empty()) {
    const std::string page = html_page(chosen, options);
    write_file(html, page);
    tell(options.html, chosen, page.size());
  }
  if (!gltf.empty()) write_scene(chosen, options, gltf);
  if (!vtu.empty()) tell(options.vtu, chosen, write_series(vtu, chosen));
  return exit_ok;
}

}  // namespace palpate
