// Files that others wrote: what reading them does to the program, and what they do to it.
#include "formats/contents.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstring>
#include <iterator>
#include <random>
#include <thread>

#include "base/error.h"
#include "base/file_io.h"
#include "base/program.h"
#include "formats/checksum.h"
#include "formats/model_file.h"
#include "formats/recording.h"
#include "formats/writer/add_index.h"
#include "formats/writer/hdf5_file.h"
#include "formats/writer/hdf5_walk.h"
#include "matrices/hierarchical_product.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/formats_tamper.h"

namespace palpate::test::contents_test {
namespace {

/// Wait status of a child that runs `work`.
int status_of_child(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGBUS, SIG_DFL);  // also where a sanitizer has a handler
    work();
    _exit(0);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return status;
}

/// A signal's action, put back when it goes.
class SignalAction {
 public:
  SignalAction(int signal, void (*handler)(int)) : signal_(signal) {
    struct sigaction action {};
    action.sa_handler = handler;
    sigaction(signal, &action, &before_);
  }
  ~SignalAction() { sigaction(signal_, &before_, nullptr); }
  SignalAction(const SignalAction&) = delete;
  SignalAction& operator=(const SignalAction&) = delete;

 private:
  int signal_;
  struct sigaction before_ {};
};

std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                       std::filesystem::directory_iterator());
}

TEST(Contents, FindsWhatWasWritten) {
  const Folder folder;
  const std::vector<double> values = {1, 2, 3, 4, 5, 6};
  {
    hdf5::File file = hdf5::File::create(folder / "a.h5");
    file.write("/group/values", number_type<double>(), std::array<std::int64_t, 2>{3, 2}, values.data());
    file.make_link("/link", "/group/values");
    file.write_attribute("/group/values", "text", std::string("of a dataset"));
    file.write_attribute("/", "numbers", std::array<std::int64_t, 3>{7, -8, 9});
    file.close();
  }
  const auto contents = Contents::read(folder / "a.h5");
  EXPECT_TRUE(contents.has("/group"));
  EXPECT_FALSE(contents.has("/link")) << "a link is not the file's own";
  EXPECT_EQ(contents.text_attribute("/group/values", "text"), "of a dataset");
  EXPECT_EQ(contents.integer_attribute("/", "numbers", 3), (std::vector<std::int64_t>{7, -8, 9}));
  EXPECT_FALSE(contents.integer_attribute("/", "numbers", 2));
  EXPECT_FALSE(contents.text_attribute("/", "numbers"));
  const Stored stored = contents.locate("/group/values", number_type<double>(), 2);
  EXPECT_EQ(stored.dims, (std::vector<std::int64_t>{3, 2}));
  ASSERT_EQ(stored.bytes, 48);
  std::vector<double> read(6);
  read_exactly(contents.file(), std::as_writable_bytes(std::span(read)), stored.offset);
  EXPECT_EQ(read, values);
  EXPECT_THROW(static_cast<void>(contents.locate("/group/values", number_type<float>(), 2)), Error);
  EXPECT_THROW(static_cast<void>(contents.locate("/group/values", number_type<double>(), 1)), Error);
  EXPECT_THROW(static_cast<void>(contents.locate("/group", number_type<double>(), 2)), Error);
}

/// A group and two datasets in a file of 40000 bytes.
FileObjects some_objects() {
  FileObjects objects;
  objects["/"].attributes = {{"format", "palpate"}, {"version", std::vector<std::int64_t>{4, 0}}};
  objects["/a"] = {.type = "float64", .dims = {3, 2}, .offset = 32'800, .bytes = 48};
  objects["/b"] = {.type = "int32", .dims = {5}, .offset = 32'848, .bytes = 20};
  objects["/c"] = {.type = "uint8", .dims = {0}};
  return objects;
}

FileDescriptor file_with(const Folder& folder, std::span<const std::byte> index) {
  std::string bytes(40'000, '\0');
  std::memcpy(bytes.data(), index.data(), index.size());
  write_bytes(folder / "a.h5", bytes);
  return open_file(folder / "a.h5", OpenMode::read);
}

TEST(Index, SaysWhatWasSaid) {
  const Folder folder;
  const auto contents = Contents::read(file_with(folder, make_index(some_objects(), 40'000, "a")));
  EXPECT_EQ(contents.text_attribute("/", "format"), "palpate");
  EXPECT_EQ(contents.integer_attribute("/", "version", 2), (std::vector<std::int64_t>{4, 0}));
  EXPECT_EQ(contents.locate("/b", number_type<std::int32_t>(), 1).offset, 32'848);
  EXPECT_EQ(contents.locate("/c", number_type<std::uint8_t>(), 1).bytes, 0);
}

struct Lie {
  const char* name;
  void (*tell)(FileObjects&);
  const char* says;
};

TEST(Index, ThatCannotBeIsRefused) {
  const Lie lies[] = {
      {"behind the end", [](FileObjects& o) { o["/a"].offset = 39'953; },
       "/a (3 x 2) needs 48 bytes, more than"},
      {"far behind", [](FileObjects& o) { o["/a"].offset = ~std::uint64_t{0}; }, "more than the file holds"},
      {"on the index", [](FileObjects& o) { o["/a"].offset = 32'767; }, "/a lies on the file's index"},
      {"on another", [](FileObjects& o) { o["/b"].offset = 32'847; }, "/b lies on /a"},
      {"in another", [](FileObjects& o) { o["/b"].offset = 32'801; }, "/b lies on /a"},
      {"at the same place", [](FileObjects& o) { o["/b"].offset = 32'800; }, " lies on /"},
      {"too few bytes", [](FileObjects& o) { o["/a"].bytes = 40; }, "index is damaged"},
      {"too many bytes", [](FileObjects& o) { o["/a"].bytes = 56; }, "index is damaged"},
      {"bytes of nothing",
       [](FileObjects& o) {
         o["/c"] = {"uint8", {0}, 33'000, 1, {}};
       },
       "index is damaged"},
      {"a place of nothing", [](FileObjects& o) { o["/c"].offset = 33'000; }, "index is damaged"},
      {"a huge size",
       [](FileObjects& o) {
         o["/a"].dims = {~std::uint64_t{0}, 2};
       },
       "/a has impossible sizes"},
      {"sizes that overflow",
       [](FileObjects& o) {
         o["/a"].dims = {1U << 31U, 1U << 30U};
       },
       "/a has impossible sizes"},
      {"an unknown type", [](FileObjects& o) { o["/a"].type = "float65"; }, "index is damaged"},
      {"a group with numbers", [](FileObjects& o) { o["/a"].type = ""; }, "index is damaged"},
  };
  for (const Lie& lie : lies) {
    const Folder folder;
    FileObjects objects = some_objects();
    lie.tell(objects);
    const std::string text =
        refusal([&] { Contents::read(file_with(folder, make_index(objects, 40'000, "a"))); });
    EXPECT_NE(text.find(lie.says), std::string::npos) << lie.name << ": " << text;
  }
}

TEST(Index, ThatDoesNotFitIsNotMade) {
  FileObjects objects;
  for (int k = 0; k < 8; ++k) objects[fmt::format("/{}", k)].attributes["text"] = std::string(4096, 'x');
  EXPECT_NE(refusal([&] { make_index(objects, 40'000, "a"); }).find("32768 are there"), std::string::npos);
}

/// docs/file-format.md: the number of bytes that the index takes, and its checksum's place.
constexpr std::size_t length_at = 16, checksum_at = 24, content_at = 56;

std::size_t length_of(std::span<const std::byte> index) {
  std::uint64_t length = 0;
  std::memcpy(&length, &index[length_at], sizeof length);
  return length;
}

TEST(Index, IsNotBelievedWhereAByteIsAnother) {
  const Folder folder;
  const std::vector<std::byte> index = make_index(some_objects(), 40'000, "a");
  for (std::size_t at = 0; at < length_of(index); ++at) {
    std::vector<std::byte> altered = index;
    altered[at] ^= std::byte{4};
    EXPECT_NE(refusal([&] { Contents::read(file_with(folder, altered)); }), "") << at;
  }
}

/// Whatever it says: what is found in the end lies in the file.
TEST(Index, WithTheRightChecksumMaySayAnything) {
  const Folder folder;
  const std::vector<std::byte> index = make_index(some_objects(), 40'000, "a");
  const std::size_t length = length_of(index);
  write_bytes(folder / "a.h5", std::string(40'000, '\0'));
  std::mt19937_64 random(5);
  int read = 0;
  for (int round = 0; round < 5000; ++round) {
    std::vector<std::byte> altered = index;
    for (std::uint64_t edits = 1 + random() % 3; edits > 0; --edits) {
      const std::size_t at = content_at + random() % (length - content_at);
      altered[at] =
          random() % 2 == 0 ? altered[at] ^ std::byte(1U << random() % 8) : std::byte(random() % 256);
    }
    const std::string digits = checksum(std::span(altered).subspan(content_at, length - content_at));
    std::memcpy(&altered[checksum_at], digits.data(), digits.size());
    try {
      const auto contents = Contents::of(open_file(folder / "a.h5", OpenMode::read), altered);
      ++read;
      if (!contents.has("/a")) continue;
      const Stored stored = contents.locate("/a", number_type<double>(), 2);
      EXPECT_GE(stored.offset, index_bytes);
      EXPECT_LE(stored.offset + stored.bytes, 40'000);
      EXPECT_EQ(stored.bytes, 8 * stored.dims[0] * stored.dims[1]);
    } catch (const Error&) {
    }
  }
  EXPECT_GT(read, 100);
}

TEST(Index, IsAddedToAModelThatHasNone) {
  const Folder folder;
  const std::filesystem::path file = folder / "a.palpate.hdf";
  write_sample(file);
  EXPECT_TRUE(is_index_right(file));
  const std::string whole = read_bytes(file);
  const std::string hdf5 = whole.substr(static_cast<std::size_t>(index_bytes));
  write_bytes(file, hdf5);
  const std::string text = refusal([&] { load_model(file); });
  EXPECT_NE(text.find("not a Palpate file with an index"), std::string::npos) << text;
  EXPECT_NE(text.find("palpate-precompute index " + file.string()), std::string::npos) << text;
  add_index(file);
  EXPECT_EQ(read_bytes(file), whole);
  write_bytes(file, std::string(512, 'x') + hdf5);  // as others begin theirs
  add_index(file);
  EXPECT_EQ(read_bytes(file), whole);
}

TEST(Index, IsWrittenAnewWhereItIsWrong) {
  const Folder folder;
  const std::filesystem::path file = folder / "a.palpate.hdf";
  write_sample(file);
  const std::string whole = read_bytes(file);
  FileObjects objects;
  objects["/"].attributes["format"] = "palpate";
  const std::vector<std::byte> wrong = make_index(objects, whole.size(), "a");
  std::string bytes = whole;
  std::memcpy(bytes.data(), wrong.data(), wrong.size());
  write_bytes(file, bytes);
  EXPECT_FALSE(is_index_right(file));
  add_index(file);
  EXPECT_TRUE(is_index_right(file));
  EXPECT_EQ(read_bytes(file), whole);
}

TEST(Index, IsNotAddedToWhatIsNoModelOfThisVersion) {
  const Folder folder;
  const std::filesystem::path file = folder / "a.palpate.hdf";
  write_sample(file);
  set_integers(file, "version", {3, 6});
  { hdf5::File::create(folder / "b.h5").close(); }
  write_bytes(folder / "c.toml", "name = 1");
  const auto expect_kept = [](const std::filesystem::path& path, const std::string& says) {
    const std::string before = read_bytes(path), text = refusal([&] { add_index(path); });
    EXPECT_NE(text.find(says), std::string::npos) << text;
    EXPECT_NE(text.find(path.string() + " |"), std::string::npos) << text;
    EXPECT_EQ(read_bytes(path), before);
  };
  expect_kept(file, "format version 3.6");
  expect_kept(folder / "b.h5", "not a Palpate file with a model");
  expect_kept(folder / "c.toml", "is not an HDF5 file");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()),
                          std::filesystem::directory_iterator()),
            3);
}

/// Changes of the process that only a fork makes.
std::atomic<int> forks = 0;

TEST(Contents, AreReadWithoutAnotherProcess) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  ASSERT_EQ(pthread_atfork([] { ++forks; }, nullptr, nullptr), 0);
  const int before = forks;
  load_model(folder / "a.palpate.hdf");
  EXPECT_EQ(forks, before);
  EXPECT_TRUE(is_index_right(folder / "a.palpate.hdf"));
  EXPECT_EQ(forks, before + 1);
}

TEST(Walk, OfAForeignFileHasALimit) {
  const Folder folder;
  {
    hdf5::File file = hdf5::File::create(folder / "a.h5");
    for (int k = 0; k < 10'001; ++k) file.make_group(fmt::format("/{}", k));
  }
  const std::string text = refusal([&] { hdf5::index_of(open_file(folder / "a.h5", OpenMode::read)); });
  EXPECT_NE(text.find("more than 10000"), std::string::npos) << text;
}

TEST(Walk, GoesThroughInAHostThatCaresForItsChildrenItself) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const std::ptrdiff_t files = open_files();
  {
    const SignalAction ignored(SIGCHLD, SIG_IGN);  // children are reaped by the kernel
    EXPECT_TRUE(is_index_right(folder / "a.palpate.hdf"));
  }
  static std::atomic<int> ended;
  ended = 0;
  {
    const SignalAction handled(SIGCHLD, [](int) {
      while (waitpid(-1, nullptr, WNOHANG) > 0) ++ended;
    });
    EXPECT_TRUE(is_index_right(folder / "a.palpate.hdf"));
    struct sigaction now {};
    sigaction(SIGCHLD, nullptr, &now);
    EXPECT_NE(now.sa_handler, SIG_DFL);
  }
  const pid_t child = fork();
  if (child == 0) _exit(5);
  EXPECT_TRUE(is_index_right(folder / "a.palpate.hdf"));
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child) << "the host's child is the host's";
  EXPECT_EQ(WEXITSTATUS(status), 5);
  EXPECT_EQ(open_files(), files);
}

TEST(Walk, GoesThroughInAHostWithThreadsAndTimers) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  const SignalAction handled(SIGALRM,
                             [](int) {});  // until the thread has ended, to which the last one may go
  std::atomic<bool> stop = false;
  std::jthread beside([&] {
    while (!stop) std::vector<std::string>(100, "memory that is taken and given back");
  });
  const itimerval often = {{0, 2000}, {0, 2000}}, never = {};
  setitimer(ITIMER_REAL, &often, nullptr);
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(is_index_right(folder / "a.palpate.hdf"));
  setitimer(ITIMER_REAL, &never, nullptr);
  stop = true;
}

// A mapped file that is cut off gives SIGBUS where it is read.
TEST(LoadedModel, DoesNotNeedItsFileAnyMore) {
  for (const bool is_swinging : {false, true}) {
    const Folder folder;
    const Model written = is_swinging
                              ? write_swinging_sample(folder / "a.palpate.hdf", DynamicsMethod::packed)
                              : write_sample(folder / "a.palpate.hdf");
    const int status = status_of_child([&] {
      const Model model = load_model(folder / "a.palpate.hdf");
      std::filesystem::resize_file(folder / "a.palpate.hdf", 0);
      for (std::int64_t i = 0; i < model.greens.order(); ++i)
        for (std::int64_t j = 0; j <= i; ++j)
          if (model.greens(i, j) != sample_entry(i, j)) _exit(1);
      if (is_swinging && !(model.dynamics.inverse(0, 0) > 0.0)) _exit(1);
    });
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
}

TEST(LoadedModel, IsMappedWhereItDoesNotFitIntoMemory) {
  const Folder folder;
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    write_sample(folder / "a.palpate.hdf", precision);
    const Model read = load_model(folder / "a.palpate.hdf");
    const Model mapped = load_model(folder / "a.palpate.hdf", {.most_in_memory = 0});
    ASSERT_EQ(mapped.greens.order(), read.greens.order());
    const auto bytes =
        static_cast<std::size_t>(packed_size(read.greens.order()) * bytes_per_scalar(precision));
    EXPECT_EQ(std::memcmp(mapped.greens.data(), read.greens.data(), bytes), 0);
  }
}

/// What a program says and ends with when the file of a model is cut off that it has mapped.
void expect_a_plain_end(const std::filesystem::path& file, const std::function<double(const Model&)>& entry) {
  int ends[2] = {};
  ASSERT_EQ(pipe(ends), 0);
  const int status = status_of_child([&] {
    dup2(ends[1], STDERR_FILENO);
    end_with_an_error_on_shrunk_files();
    const Model model = load_model(file, {.most_in_memory = 0});
    std::filesystem::resize_file(file, 0);
    if (entry(model) != 0.0) _exit(77);
  });
  close(ends[1]);
  std::array<char, 1000> text = {};
  ASSERT_GT(read(ends[0], text.data(), text.size() - 1), 0);
  close(ends[0]);
  ASSERT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), exit_input_error);
  EXPECT_EQ(std::string(text.data()),
            "error: " + file.string() +
                ": was cut off while it was in use, or its disk failed (bus error)\n"
                "hint: Leave files alone while a program reads them, and start it again\n");
}

TEST(LoadedModel, ThatIsMappedEndsAProgramPlainlyWhereItsFileIsCutOff) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  expect_a_plain_end(folder / "a.palpate.hdf", [](const Model& model) { return model.greens(0, 0); });
  write_compressed_sample(folder / "b.palpate.hdf");
  expect_a_plain_end(folder / "b.palpate.hdf", [](const Model& model) {
    std::array<double, 9> block = {};
    const Index node = 0;
    gather_blocks(*model.compressed, node, {&node, 1}, block);
    return block[0];
  });
}

TEST(MappedFile, IsKnownByItsNameForAsLongAsItIsMapped) {
  const Folder folder;
  write_bytes(folder / "a\nb", std::string(10'000, 'x'));
  const FileDescriptor file = open_file(folder / "a\nb", OpenMode::read);
  const char* bytes = nullptr;
  for (int round = 0; round < 100; ++round) {
    const std::shared_ptr<const void> mapped = map_file(file, 100, 9'900);
    bytes = static_cast<const char*>(mapped.get());
    for (const char* at : {bytes, bytes + 9'899}) {
      ASSERT_NE(mapped_file_at(at), nullptr) << round;
      EXPECT_EQ(mapped_file_at(at), (folder.path() / "a\\nb").string());
    }
    EXPECT_EQ(mapped_file_at(bytes + 9'900 + 4096), nullptr);
  }
  EXPECT_EQ(mapped_file_at(bytes), nullptr);
  std::vector<std::shared_ptr<const void>> many;
  for (int k = 0; k < 100; ++k) many.push_back(map_file(file, 0, 10'000));
  EXPECT_NE(mapped_file_at(many.front().get()), nullptr);
  EXPECT_NO_THROW(many.clear());
}

TEST(Contents, OfWhatIsNoFileAreRefusedAtOnce) {
  const Folder folder;
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  for (const std::filesystem::path& path :
       {folder / "fifo", folder.path(), std::filesystem::path("/dev/zero"), folder / "none"}) {
    EXPECT_NE(refusal([&] { load_model(path); }), "") << path;
    EXPECT_NE(refusal([&] { RecordingFile{path}; }), "") << path;
  }
}

}  // namespace
}  // namespace palpate::test::contents_test
