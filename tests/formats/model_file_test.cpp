// Writing, continuing and reading NAME.palpate.hdf.
#include "formats/model_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <thread>

#include "base/error.h"
#include "formats/checksum.h"
#include "formats/contents.h"
#include "formats/journal.h"
#include "formats/writer/hdf5_file.h"
#include "formats/writer/model_writer.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::model_file_test {
namespace {

using testing::Values;

/// No file may grow beyond `bytes` while this lives: what a full disk does to a writer.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : ignored_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, ignored_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_ = {};
  void (*ignored_)(int);
};

std::vector<std::string> files_in(const Folder& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

using Names = std::vector<std::string>;

class BothPrecisions : public testing::TestWithParam<Precision> {};

TEST_P(BothPrecisions, WhatIsWrittenIsRead) {
  const Folder folder;
  const Model written = write_sample(folder / "a.palpate.hdf", GetParam());
  const Model read = load_model(folder / "a.palpate.hdf");
  Model without_greens = read;
  without_greens.greens = {};
  EXPECT_EQ(difference(written, without_greens), "");
  EXPECT_EQ(read.content_hash.size(), 32U);
  ASSERT_EQ(read.greens.order(), written.stored_dofs());
  ASSERT_EQ(read.greens.precision(), GetParam());
  for (std::int64_t i = 0; i < read.greens.order(); ++i) {
    for (std::int64_t j = 0; j < read.greens.order(); ++j) {
      const double exact = i >= j ? sample_entry(i, j) : sample_entry(j, i);
      const double stored =
          GetParam() == Precision::single_precision ? static_cast<double>(static_cast<float>(exact)) : exact;
      ASSERT_EQ(read.greens(i, j), stored) << i << ", " << j;
    }
  }
  EXPECT_EQ(files_in(folder), Names{"a.palpate.hdf"});
}

TEST_P(BothPrecisions, EqualModelsMakeEqualFilesInAnyOrderOfColumns) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf", GetParam());
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "b.palpate.hdf", model, GetParam());
  {
    std::vector<std::jthread> threads;
    for (std::int64_t j = n; j-- > 0;)
      threads.emplace_back([&writer, j, n] { writer.write_columns(j, 1, sample_columns(j, 1, n)); });
  }
  writer.finish(model.probes);
  EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), read_bytes(folder / "b.palpate.hdf"));
}

class EveryElement : public testing::TestWithParam<ElementType> {};

TEST_P(EveryElement, WhatIsWrittenIsRead) {
  const Folder folder;
  const Model written = write_sample(folder / "a.palpate.hdf", Precision::double_precision, GetParam());
  Model read = load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(read.mesh.element, GetParam());
  ASSERT_EQ(read.greens.order(), traits(GetParam()).dimension * std::ssize(written.stored_nodes));
  EXPECT_EQ(read.greens(3, 1), sample_entry(3, 1));
  read.greens = {};
  EXPECT_EQ(difference(written, read), "");
}

INSTANTIATE_TEST_SUITE_P(ModelFile, EveryElement, testing::ValuesIn(body_elements),
                         [](const auto& element) { return std::string(traits(element.param).name); });

INSTANTIATE_TEST_SUITE_P(ModelFile, BothPrecisions,
                         Values(Precision::single_precision, Precision::double_precision));

TEST(ModelFile, WithoutGreensFunctionsHoldsTheRest) {
  const Folder folder;
  Model written = sample_model();
  written.scope = Scope::none;
  Model storing = written;
  storing.overlay = {};
  EXPECT_THROW(ModelWriter(folder / "a.palpate.hdf", storing, Precision::single_precision), Error);
  written.stored_nodes.clear();
  written.probes.clear();
  EXPECT_THROW(ModelWriter(folder / "a.palpate.hdf", written, Precision::single_precision),
               Error);  // overlays
  written.overlay = {};
  ModelWriter(folder / "a.palpate.hdf", written, Precision::single_precision).finish({});
  const Model read = load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(read.scope, Scope::none);
  EXPECT_EQ(difference(written, read), "");
  EXPECT_FALSE(Contents::read(folder / "a.palpate.hdf").has("/greens/packed"));
  EXPECT_EQ(files_in(folder), Names{"a.palpate.hdf"});
}

TEST(ModelFile, TheOutlineIsTheBodyWithoutTheRest) {
  const Folder folder;
  const Model written = write_sample(folder / "a.palpate.hdf", Precision::double_precision);
  const Model read = load_outline(folder / "a.palpate.hdf");
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.mesh.nodes, written.mesh.nodes);
  EXPECT_EQ(read.mesh.connectivity, written.mesh.connectivity);
  EXPECT_EQ(read.surface, written.surface);
  EXPECT_EQ(read.fixed, written.fixed);
  EXPECT_EQ(read.rest_displacement, written.rest_displacement);
  EXPECT_EQ(read.greens.order(), 0);
  EXPECT_TRUE(read.probes.empty());
}

TEST(ModelFile, GreensFunctionsStartOnAPage) {
  const Folder folder;
  const Model model = write_sample(folder / "a.palpate.hdf");
  const auto file = Contents::read(folder / "a.palpate.hdf");
  const Stored greens = file.locate("/greens/packed", number_type<double>(), 1);
  EXPECT_EQ(greens.offset % 4096, 0);
  EXPECT_EQ(greens.dims, std::vector<std::int64_t>{packed_size(model.stored_dofs())});
}

TEST(ModelFile, NoObjectHasATime) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const auto file = hdf5::File::open_to_change(folder / "a.palpate.hdf");
  const auto visit = [](hid_t, const char*, const H5O_info_t* info, void* objects) -> herr_t {
    ++*static_cast<int*>(objects);
    return info->ctime == 0 && info->mtime == 0 && info->atime == 0 && info->btime == 0 ? 0 : 1;
  };
  int objects = 0;
  EXPECT_EQ(H5Ovisit2(file.id(), H5_INDEX_NAME, H5_ITER_INC, visit, &objects, H5O_INFO_ALL), 0);
  EXPECT_GT(objects, 20);
}

TEST(ModelFile, ChecksumsFollowTheDocumentedRule) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const Model before = load_model(folder / "a.palpate.hdf");
  reseal(folder / "a.palpate.hdf");  // computes them a second way
  const Model after = load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(before.content_hash, after.content_hash);
}

TEST(ModelFile, AModelWithoutProbesTextSourcesAndOverlays) {
  const Folder folder;
  Model model = sample_model();
  model.model_toml.clear();
  model.name.clear();
  model.sources.clear();
  model.probes.clear();
  model.overlay = {};
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::single_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  writer.finish({});
  Model read = load_model(folder / "a.palpate.hdf");
  read.greens = {};
  EXPECT_EQ(difference(model, read), "");
}

TEST(ModelFile, IsThereOnlyWhenFinished) {
  const Folder folder;
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
  writer.write_columns(0, n - 1, sample_columns(0, n - 1, n));
  EXPECT_EQ(files_in(folder), (Names{"a.palpate.hdf.partial", "a.palpate.hdf.progress"}));
  EXPECT_NE(refusal([&] { writer.finish(model.probes); }).find("column 53"), std::string::npos);
  writer.write_columns(n - 1, 1, sample_columns(n - 1, 1, n));
  writer.finish(model.probes);
  EXPECT_EQ(files_in(folder), Names{"a.palpate.hdf"});
}

TEST(ModelFile, AnEarlierFileSurvivesUntilTheRename) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const std::string before = read_bytes(folder / "a.palpate.hdf");
  Model model = sample_model();
  model.name = "another";
  {
    ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
    EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), before);
    writer.discard();
  }
  EXPECT_EQ(files_in(folder), Names{"a.palpate.hdf"});
  EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), before);
}

TEST(ModelFile, AKilledRunIsContinued) {
  const Folder folder;
  write_sample(folder / "straight.palpate.hdf");
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  {
    ModelWriter killed(folder / "a.palpate.hdf", model, Precision::double_precision);
    killed.write_columns(0, 10, sample_columns(0, 10, n));
    killed.write_columns(30, 5, sample_columns(30, 5, n));
  }
  {
    ModelWriter killed_again(folder / "a.palpate.hdf", model, Precision::double_precision);
    EXPECT_TRUE(killed_again.has_columns(0, 10));
    EXPECT_TRUE(killed_again.has_columns(30, 5));
    EXPECT_FALSE(killed_again.has_columns(9, 2));
    EXPECT_FALSE(killed_again.has_columns(29, 2));
    killed_again.write_columns(10, 20, sample_columns(10, 20, n));
  }
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
  EXPECT_TRUE(writer.has_columns(0, 35));
  EXPECT_FALSE(writer.has_columns(35, n - 35));
  EXPECT_FALSE(writer.has_columns(0, n + 1));
  writer.write_columns(35, n - 35, sample_columns(35, n - 35, n));
  writer.finish(model.probes);
  EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), read_bytes(folder / "straight.palpate.hdf"));
}

TEST(ModelFile, AKillAtAnyMomentLosesNothing) {
  const Folder folder;
  write_sample(folder / "straight.palpate.hdf");
  const std::string straight = read_bytes(folder / "straight.palpate.hdf");
  const std::filesystem::path path = folder / "a.palpate.hdf";
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  const auto write = [&] {
    ModelWriter writer(path, model, Precision::double_precision);
    for (std::int64_t j = 0; j < n; ++j)
      if (!writer.has_columns(j, 1)) writer.write_columns(j, 1, sample_columns(j, 1, n));
    writer.finish(model.probes);
  };
  for (useconds_t delay = 0; delay < 6000; delay += 150) {
    const pid_t child = ::fork();
    if (child == 0) {
      write();
      ::_exit(0);
    }
    ::usleep(delay);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    if (!std::filesystem::exists(path)) continue;
    EXPECT_EQ(read_bytes(path), straight) << delay;
    if (delay % 300 == 0) std::filesystem::remove(path);
  }
  write();
  EXPECT_EQ(read_bytes(path), straight);
  EXPECT_EQ(files_in(folder), (Names{"a.palpate.hdf", "straight.palpate.hdf"}));
}

/// Leaves a killed run with columns [0, 10) and [30, 35) done and lets `harm` do something to its files.
ModelWriter after_kill(const Folder& folder, const Model& again, Precision precision,
                       const std::function<void()>& harm) {
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  {
    ModelWriter killed(folder / "a.palpate.hdf", model, Precision::double_precision);
    killed.write_columns(0, 10, sample_columns(0, 10, n));
    killed.write_columns(30, 5, sample_columns(30, 5, n));
  }
  harm();
  return {folder / "a.palpate.hdf", again, precision};
}

void flip(const std::filesystem::path& path, std::size_t byte) {
  std::string bytes = read_bytes(path);
  bytes.at(byte) = static_cast<char>(bytes.at(byte) ^ 1);
  write_bytes(path, bytes);
}

TEST(ModelFile, AnotherModelStartsAnew) {
  const Folder folder;
  Model other = sample_model();
  other.materials[1].youngs_modulus *= 2;
  EXPECT_FALSE(after_kill(folder, other, Precision::double_precision, [] {}).has_columns(0, 1));
}

TEST(ModelFile, AnotherFrictionStartsAnew) {
  const Folder folder;
  Model other = sample_model();
  other.materials[1].friction = 0.125;
  EXPECT_FALSE(after_kill(folder, other, Precision::double_precision, [] {}).has_columns(0, 1));
}

TEST(ModelFile, AnotherOverlayStartsAnew) {
  const Folder folder;
  Model other = sample_model();
  other.overlay.patches[1].compliance(0, 0) += 1.0;
  EXPECT_FALSE(after_kill(folder, other, Precision::double_precision, [] {}).has_columns(0, 1));
}

TEST(ModelFile, AnotherPrecisionStartsAnew) {
  const Folder folder;
  EXPECT_FALSE(after_kill(folder, sample_model(), Precision::single_precision, [] {}).has_columns(0, 1));
}

TEST(ModelFile, AlteredColumnsAreDroppedAndTheOthersKept) {
  const Folder folder;
  const std::filesystem::path partial = folder / "a.palpate.hdf.partial";
  const auto writer = after_kill(folder, sample_model(), Precision::double_precision, [&] {
    const double changed = 5.0;
    ASSERT_TRUE(set_entry(partial, "/greens/packed", 3, changed));
  });
  EXPECT_FALSE(writer.has_columns(0, 1));
  EXPECT_TRUE(writer.has_columns(30, 5));
}

TEST(ModelFile, AMistakeDoesNotCostAnEarlierRunsColumns) {
  const Folder folder;
  Model wrong = sample_model();
  wrong.materials[0].poissons_ratio = 0.7;
  EXPECT_NE(refusal([&] {
              after_kill(folder, wrong, Precision::double_precision, [] {});
            }).find("/material/isotropic"),
            std::string::npos);
  const ModelWriter writer(folder / "a.palpate.hdf", sample_model(), Precision::double_precision);
  EXPECT_TRUE(writer.has_columns(0, 10));
}

TEST(ModelFile, AnAlteredFrameStartsAnew) {
  const Folder folder;
  const auto writer = after_kill(folder, sample_model(), Precision::double_precision,
                                 [&] { flip(folder / "a.palpate.hdf.partial", 1000); });
  EXPECT_FALSE(writer.has_columns(30, 5));
}

TEST(ModelFile, AJournalCutInItsLastLineKeepsTheOthers) {
  const Folder folder;
  const std::filesystem::path journal = folder / "a.palpate.hdf.progress";
  const auto writer = after_kill(folder, sample_model(), Precision::double_precision, [&] {
    std::filesystem::resize_file(journal, std::filesystem::file_size(journal) - 3);
  });
  EXPECT_TRUE(writer.has_columns(0, 10));
  EXPECT_FALSE(writer.has_columns(30, 5));
}

constexpr std::string_view first_word = "palpate-progress ";  // of a journal

TEST(ModelFile, AnyCutOrFlippedJournalIsHarmless) {
  const Model model = sample_model();
  for (std::size_t at = 0; at < 190; at += 7) {
    const Folder folder;
    const std::filesystem::path journal = folder / "a.palpate.hdf.progress";
    const auto writer = after_kill(folder, model, Precision::double_precision, [&] {
      std::string text = read_bytes(journal);
      if (at >= first_word.size()) text.at(at) = static_cast<char>(text.at(at) ^ 5);
      write_bytes(journal, at % 2 == 0 && at >= first_word.size() ? text : text.substr(0, at));
    });
    EXPECT_FALSE(writer.has_columns(10, 1));
    EXPECT_FALSE(writer.has_columns(0, 35));
  }
}

/// Their sums must not overflow, and nobody counts to them.
TEST(ModelFile, AJournalWithNumbersBeyondAllIsNone) {
  const std::string frame = "palpate-progress 2\nmodel key 4096 checksum 4096\n";
  const auto parts_of = [&](const std::string& line) {
    const auto journal = read_journal(frame + "part " + line + "\n");
    return journal && journal->frame.part ? journal->frame.part->parts : 0;
  };
  EXPECT_EQ(parts_of("1 2 0 576"), 2);
  EXPECT_EQ(parts_of("1 2 0 9223372036854775807"), 0);
  EXPECT_EQ(parts_of("1 9223372036854775807 0 576"), 0);
  EXPECT_EQ(parts_of("99999 100000 0 576"), 100'000);
  EXPECT_EQ(parts_of("1 100001 0 576"), 0);
  EXPECT_FALSE(read_range("columns 0 0 9223372036854775807 checksum"));
  EXPECT_FALSE(read_journal("palpate-progress 2\nmodel key 9223372036854775807 checksum 4096\n"));
}

TEST(ModelFile, AJournalThatIsNoneIsAnothersFile) {
  for (std::size_t at = 0; at < first_word.size(); ++at) {
    const Folder folder;
    const std::filesystem::path journal = folder / "a.palpate.hdf.progress";
    std::string text;
    const std::string refused = refusal([&] {
      after_kill(folder, sample_model(), Precision::double_precision, [&] {
        text = read_bytes(journal);
        text.at(at) = static_cast<char>(text.at(at) ^ 5);
        write_bytes(journal, text);
      });
    });
    EXPECT_NE(refused.find("is in the way"), std::string::npos) << refused;
    EXPECT_EQ(read_bytes(journal), text);
  }
}

TEST(ModelFile, OneWriterAtATime) {
  const Folder folder;
  const Model model = sample_model();
  const ModelWriter first(folder / "a.palpate.hdf", model, Precision::double_precision);
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("another palpate-precompute"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "a.palpate.hdf.partial"));
}

TEST(ModelFile, WhatAKilledRunHasForkedMayEndAfterIt) {
  const Folder folder;
  const Model model = sample_model();
  const pid_t killed = ::fork();
  if (killed == 0) {
    const ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
    if (::fork() == 0) ::usleep(300'000);  // it has the lock too
    ::_exit(0);
  }
  ::waitpid(killed, nullptr, 0);
  EXPECT_NO_THROW(ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision));
}

TEST(ModelFile, WhatAReaderWouldRefuseIsNotWritten) {
  const Folder folder;
  Model model = sample_model();
  model.stored_nodes.push_back(model.stored_nodes.front());
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("there twice"),
            std::string::npos);
  model = sample_model();
  model.fixed.pop_back();
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("/dofs/fixed"),
            std::string::npos);
  model = sample_model();
  model.mesh.connectivity.pop_back();
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("/mesh/connectivity has 191 values"),
            std::string::npos);
  model = sample_model(ElementType::quad4);
  model.analysis = Analysis::solid;
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("analysis"),
            std::string::npos);
  model = sample_model();
  model.materials[1].friction = -0.5;
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("/material/friction, row 1 is -0.5"),
            std::string::npos);
  model = sample_model();
  model.overlay.patches[0].T.conservativeResize(4, Eigen::NoChange);
  EXPECT_NE(refusal([&] {
              ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision);
            }).find("/overlay/T has 51 values, 81 are expected"),
            std::string::npos);
  EXPECT_EQ(files_in(folder), Names{});
}

TEST(ModelFile, ColumnsThatAreNotFiniteOrDoNotFitAreRefused) {
  const Folder folder;
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  std::vector<double> column = sample_columns(4, 1, n);
  {
    ModelWriter writer(folder / "a.palpate.hdf", model, Precision::single_precision);
    EXPECT_NE(refusal([&] { writer.write_columns(3, 1, column); }).find("do not fit"), std::string::npos);
    column[2] = 1e39;  // fits double, not single
    EXPECT_NE(refusal([&] { writer.write_columns(4, 1, column); }).find("not finite"), std::string::npos);
  }
  EXPECT_EQ(files_in(folder), Names{});
}

TEST(ModelFile, ProbesOfAnotherSizeAreRefused) {
  const Folder folder;
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::single_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  EXPECT_NE(refusal([&] { writer.finish({{{1.0}, {1.0}}}); }).find("/probes"), std::string::npos);
  EXPECT_EQ(files_in(folder), Names{});
}

TEST(ModelFile, AMissingFolderIsNamed) {
  const Folder folder;
  const std::string text = refusal(
      [&] { ModelWriter(folder / "none" / "a.palpate.hdf", sample_model(), Precision::double_precision); });
  EXPECT_NE(text.find("none/a.palpate.hdf"), std::string::npos) << text;
  EXPECT_NE(text.find("No such file"), std::string::npos) << text;
}

TEST(FullDisk, AtTheStartLeavesNothing) {
  const Folder folder;
  for (const rlim_t bytes : {rlim_t{0}, rlim_t{50}, rlim_t{1000}, rlim_t{10000}}) {
    const FullDisk full(bytes);
    const std::string text =
        refusal([&] { ModelWriter(folder / "a.palpate.hdf", sample_model(), Precision::double_precision); });
    EXPECT_NE(text.find("File too large"), std::string::npos) << bytes << ": " << text;
    EXPECT_EQ(files_in(folder), Names{}) << bytes;
  }
}

TEST(FullDisk, WhileColumnsArriveLeavesNothing) {
  const Folder folder;
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
  const FullDisk full(16384);
  const std::string text = refusal([&] { writer.write_columns(0, n, sample_columns(0, n, n)); });
  EXPECT_NE(text.find("File too large"), std::string::npos) << text;
  EXPECT_NE(text.find("ree some disk space"), std::string::npos) << text;
  EXPECT_EQ(files_in(folder), Names{});
}

TEST(FullDisk, AtTheEndLeavesTheEarlierFile) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const std::string before = read_bytes(folder / "a.palpate.hdf");
  const Model model = sample_model();
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(folder / "a.palpate.hdf", model, Precision::double_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  const FullDisk full(1000);
  EXPECT_NE(refusal([&] { writer.finish(model.probes); }).find("File too large"), std::string::npos);
  EXPECT_EQ(files_in(folder), Names{"a.palpate.hdf"});
  EXPECT_EQ(read_bytes(folder / "a.palpate.hdf"), before);
}

TEST(FullDisk, IsToldBeforehandWithTheNumbers) {
  const Folder folder;
  Model model = sample_model();
  // A body of a million free nodes in one element asks for 36 TB.
  model.mesh.nodes.resize(1'000'027, Vec3::Zero());
  model.fixed.resize(model.mesh.nodes.size(), 0);
  model.rest_force.resize(model.mesh.nodes.size(), Vec3::Zero());
  model.rest_displacement.resize(model.mesh.nodes.size(), Vec3::Zero());
  for (Index i = 27; i < 1'000'027; ++i) model.stored_nodes.push_back(i);
  const std::string text =
      refusal([&] { ModelWriter(folder / "a.palpate.hdf", model, Precision::double_precision); });
  EXPECT_NE(text.find("the disk is too full: 360"), std::string::npos) << text;
  EXPECT_NE(text.find("MB are free"), std::string::npos) << text;
  EXPECT_EQ(files_in(folder), Names{});
}

TEST(Staleness, ChangedAndMissingSourcesAreNamed) {
  const Folder folder;
  std::filesystem::create_directory(folder / "in");
  std::filesystem::create_directory(folder / "out");
  const std::filesystem::path baked = folder / "out" / "a.palpate.hdf";
  write_bytes(folder / "in" / "model.toml", "name = 1");
  write_bytes(folder / "in" / "box.off", "OFF");
  Model model;
  model.sources = {describe_source("model", folder / "in" / "model.toml", baked),
                   describe_source("geometry", folder / "in" / "box.off", baked)};
  EXPECT_EQ(model.sources[0].path, "../in/model.toml");
  EXPECT_EQ(model.sources[0].bytes, 8);
  EXPECT_EQ(model.sources[0].checksum, checksum(std::string_view("name = 1")));
  EXPECT_TRUE(stale_sources(model, baked).empty());

  write_bytes(folder / "in" / "model.toml", "name = 2");
  auto stale = stale_sources(model, baked);
  ASSERT_EQ(stale.size(), 1U);
  EXPECT_NE(stale[0].find("model.toml (model) changed since a.palpate.hdf"), std::string::npos) << stale[0];
  EXPECT_NE(stale[0].find("same size"), std::string::npos) << stale[0];

  write_bytes(folder / "in" / "model.toml", "name = 20");
  std::filesystem::remove(folder / "in" / "box.off");
  stale = stale_sources(model, baked);
  ASSERT_EQ(stale.size(), 2U);
  EXPECT_NE(stale[0].find("had 8 bytes, now it has 9; precompute it again"), std::string::npos) << stale[0];
  EXPECT_NE(stale[1].find("is not there"), std::string::npos) << stale[1];
  EXPECT_NE(stale[1].find("box.off (geometry)"), std::string::npos) << stale[1];

  std::filesystem::remove(folder / "in" / "model.toml");  // the file alone was moved: one sentence
  stale = stale_sources(model, baked);
  ASSERT_EQ(stale.size(), 1U);
  EXPECT_EQ(stale[0].find("precompute it again"), std::string::npos) << stale[0];
}

TEST(Staleness, TheTwoFilesMayMoveTogether) {
  const Folder folder;
  std::filesystem::create_directory(folder / "here");
  write_bytes(folder / "here" / "model.toml", "name = 1");
  Model model;
  model.sources = {
      describe_source("model", folder / "here" / "model.toml", folder / "here" / "a.palpate.hdf")};
  std::filesystem::rename(folder / "here", folder / "there");
  EXPECT_TRUE(stale_sources(model, folder / "there" / "a.palpate.hdf").empty());
}

}  // namespace
}  // namespace palpate::test::model_file_test
