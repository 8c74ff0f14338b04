// The OpenIGTLink server over real sockets.
#include "runtime/igtl/igtl_server.h"

#include <gtest/gtest.h>
#include <igtlImageMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <chrono>
#include <optional>
#include <random>
#include <thread>

#include "base/error.h"
#include "runtime/igtl/igtl_messages.h"
#include "tests/support/files/igtl_reader.h"

namespace palpate::igtl_server_test {
namespace {

using test::IgtlReader;

/// A client at an address of its own of the loopback's.
class MachineReader {
 public:
  MachineReader(int port, const std::string& address) {
    namespace asio = boost::asio;
    socket_.open(asio::ip::tcp::v4());
    socket_.bind({asio::ip::make_address(address), 0});
    socket_.connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(port)});
  }

  /// It is sent something.
  bool is_served() {
    std::array<char, 58> header{};
    boost::system::error_code problem;
    boost::asio::read(socket_, boost::asio::buffer(header), problem);
    return !problem;
  }

 private:
  boost::asio::io_context context_;
  boost::asio::ip::tcp::socket socket_{context_};
};

/// A server in a thread of its own, and pictures of which each is a second later.
class IgtlServing : public testing::Test {
 protected:
  void SetUp() override {
    ListeningSocket socket({}, "test");
    port_ = socket.address().port;
    server_.emplace(context_, std::move(socket));
    thread_ = std::thread([this] { context_.run(); });
  }
  void TearDown() override {
    context_.stop();
    thread_.join();
  }

  /// The time of the picture that it shows.
  double show(double later = 1.0) {
    picture_.time += later;
    boost::asio::post(context_, [this, picture = picture_] { server_->show(picture); });
    return picture_.time;
  }

  /// Whether the client is shown what comes.
  void expect_served(IgtlReader& client) {
    const double shown = show();
    for (;;) {
      const auto surface = client.next<igtl::PolyDataMessage>();
      ASSERT_TRUE(surface) << "it was turned away";
      if (test::time_of(*surface) >= shown) return;
    }
  }

  static constexpr std::size_t nodes = 386;
  WatchedPicture picture_ = [] {
    WatchedPicture picture;
    picture.nodes.resize(nodes);
    picture.cells = {0, 1, 2};
    for (auto* values : {&picture.displacement, &picture.von_mises, &picture.pressure}) values->resize(nodes);
    return picture;
  }();
  boost::asio::io_context context_{1};
  std::optional<IgtlServer> server_;
  int port_ = 0;

 private:
  std::thread thread_;
};

TEST_F(IgtlServing, SendsSurfaceToolAndForce) {
  IgtlReader client(port_);
  const double shown = show();
  const auto surface = client.next<igtl::PolyDataMessage>();
  const auto tool = test::unpack<igtl::TransformMessage>(client.read());
  const auto force = test::unpack<igtl::StringMessage>(client.read());
  ASSERT_TRUE(surface && tool && force);
  EXPECT_EQ(test::time_of(*surface), shown);
  EXPECT_EQ(test::time_of(*tool), shown);
  EXPECT_EQ(test::time_of(*force), shown);
  EXPECT_EQ(surface->GetPoints()->GetNumberOfPoints(), static_cast<int>(nodes));
}

TEST_F(IgtlServing, WhoComesLaterIsSentWhatStands) {
  const double shown = show();
  for (int k = 0; k < 3; ++k) {
    IgtlReader client(port_);
    EXPECT_EQ(test::time_of(*client.next<igtl::PolyDataMessage>()), shown);
  }
}

TEST_F(IgtlServing, ThePictureOfTheEndIsSent) {
  IgtlReader client(port_);
  expect_served(client);
  show(0.001);  // sooner than the pace
  boost::asio::post(context_, [this] { server_->finish(); });
  double time = 0.0;
  while (time < 1.0005) time = test::time_of(*client.next<igtl::PolyDataMessage>());
  EXPECT_NEAR(time, 1.001, 1e-9);
  while (!context_.stopped()) std::this_thread::yield();
}

TEST_F(IgtlServing, OfEightOfOneMachineTheNewestGivesWay) {
  static_assert(most_igtl_clients == 8);
  std::vector<std::unique_ptr<IgtlReader>> clients;
  for (std::size_t k = 0; k < most_igtl_clients; ++k) {
    clients.push_back(std::make_unique<IgtlReader>(port_));
    expect_served(*clients.back());
  }
  IgtlReader own(port_);
  expect_served(own);
  MachineReader other(port_, "127.0.0.2");
  show();
  EXPECT_TRUE(other.is_served());
  for (IgtlReader* const gone : {clients.back().get(), &own})
    EXPECT_FALSE(gone->next<igtl::ImageMessage>()) << "it ends";
  clients.pop_back();
  for (const auto& client : clients) expect_served(*client);
  EXPECT_TRUE(other.is_served());
}

TEST_F(IgtlServing, EachOfEightMachinesKeepsItsPlace) {
  show();
  std::vector<std::unique_ptr<MachineReader>> machines;
  for (std::size_t k = 0; k < most_igtl_clients; ++k) {
    machines.push_back(std::make_unique<MachineReader>(port_, "127.0.0." + std::to_string(k + 2)));
    EXPECT_TRUE(machines.back()->is_served());
  }
  IgtlReader another(port_);
  EXPECT_EQ(another.read(), "") << "it is turned away";
  machines.pop_back();
  for (int attempt = 0; attempt < 500;
       ++attempt) {  // one is gone, which the server sees with nothing to send
    IgtlReader later(port_);
    if (!later.read().empty()) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  FAIL() << "a place is free, and nobody gets it";
}

TEST_F(IgtlServing, WhatClientsSayDoesNoHarm) {
  std::mt19937 random(3);
  std::string noise(100'000, '\0');
  for (char& c : noise) c = static_cast<char>(random() & 0xFFU);
  auto get = igtl::GetPolyDataMessage::New();
  get->SetDeviceName("Palpate surface");
  get->Pack();
  const std::string query(static_cast<const char*>(get->GetPackPointer()),
                          static_cast<std::size_t>(get->GetPackSize()));
  std::string huge = query;
  std::fill_n(huge.begin() + 42, 8, '\xFF');  // size of the body
  IgtlReader other(port_);
  for (const std::string& said :
       {query, query.substr(0, 30), huge, noise, std::string("GET / HTTP/1.1\r\nHost: there\r\n\r\n")}) {
    IgtlReader client(port_);
    client.say(said);
    expect_served(client);
    client.say(said);
    expect_served(client);
    expect_served(other);
  }
}

TEST_F(IgtlServing, WhoReadsNothingHoldsUpNobodyAndIsCut) {
  namespace asio = boost::asio;
  asio::io_context context;
  asio::ip::tcp::socket stalled(context);
  stalled.open(asio::ip::tcp::v4());
  stalled.set_option(asio::socket_base::receive_buffer_size(4096));
  stalled.connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(port_)});
  IgtlReader other(port_);
  using Clock = std::chrono::steady_clock;
  for (const auto end = Clock::now() + std::chrono::seconds(7); Clock::now() < end;) expect_served(other);

  // What was under way is still in the sockets' own room, and then it ends.
  timeval wait{.tv_sec = 60, .tv_usec = 0};
  setsockopt(stalled.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
  std::vector<char> room(1 << 20);
  std::size_t received = 0;
  ssize_t got = 0;
  while ((got = recv(stalled.native_handle(), room.data(), room.size(), 0)) > 0)
    received += static_cast<std::size_t>(got);
  EXPECT_TRUE(got == 0 || errno == ECONNRESET) << errno;
  EXPECT_LT(received, 4U << 20U);
  expect_served(other);
}

TEST_F(IgtlServing, TimeInWhichTheServerIsHeldUpIsNoClients) {
  IgtlReader first(port_);
  expect_served(first);
  std::vector<std::unique_ptr<MachineReader>> others;
  for (std::size_t k = 1; k < most_igtl_clients; ++k) {
    others.push_back(std::make_unique<MachineReader>(port_, "127.0.0.2"));
    EXPECT_TRUE(others.back()->is_served());
  }
  show();
  boost::asio::post(context_, [] { std::this_thread::sleep_for(std::chrono::seconds(6)); });
  others.push_back(std::make_unique<MachineReader>(port_, "127.0.0.2"));
  EXPECT_TRUE(others.back()->is_served());
  expect_served(first);
}

/// Each reads a little whenever the honest one tries, and so makes some progress all the time.
TEST_F(IgtlServing, EightThatReadSlowlyGiveWay) {
  namespace asio = boost::asio;
  asio::io_context context;
  std::vector<asio::ip::tcp::socket> slow;
  for (std::size_t k = 0; k < most_igtl_clients; ++k) {
    asio::ip::tcp::socket& one = slow.emplace_back(context);
    one.open(asio::ip::tcp::v4());
    one.set_option(asio::socket_base::receive_buffer_size(4096));
    one.connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(port_)});
  }
  std::array<char, 30> little{};
  for (int attempt = 0; attempt < 500; ++attempt) {
    show();
    for (asio::ip::tcp::socket& one : slow)
      static_cast<void>(recv(one.native_handle(), little.data(), little.size(), MSG_DONTWAIT));
    IgtlReader honest(port_);
    if (!honest.read().empty()) return expect_served(honest);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  FAIL() << "slow readers keep all others out";
}

TEST(IgtlSocket, RefusesWhatItCannotHave) {
  const ListeningSocket first({}, "--igtl");
  try {
    const ListeningSocket second(first.address(), "--igtl");
    FAIL() << "the port is taken twice";
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "127.0.0.1:" + std::to_string(first.address().port));
    EXPECT_NE(std::string(error.hint()).find("choose another port"), std::string::npos);
  }
  EXPECT_THROW(ListeningSocket({.address = "somewhere", .port = 0}, "--igtl"), Error);
  EXPECT_THROW(ListeningSocket({.address = "192.0.2.1", .port = 0}, "--igtl"), Error);  // of no machine
}

}  // namespace
}  // namespace palpate::igtl_server_test
