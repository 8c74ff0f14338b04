// Messages of OpenIGTLink, read by the OpenIGTLink library.
#pragma once

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlMessageHeader.h>

#include <cmath>
#include <cstring>
#include <string>

namespace palpate::test {

/// A message of which checksum and type are right; null where they are not.
template <class Message>
typename Message::Pointer unpack(const std::string& bytes) {
  auto header = igtl::MessageHeader::New();
  header->InitPack();
  const auto size = static_cast<std::size_t>(header->GetPackSize());
  if (bytes.size() < size) return nullptr;
  std::memcpy(header->GetPackPointer(), bytes.data(), size);
  header->Unpack();
  auto message = Message::New();
  if (std::string(header->GetDeviceType()) != message->GetDeviceType()) return nullptr;
  message->SetMessageHeader(header);
  message->AllocatePack();
  const auto body = static_cast<std::size_t>(message->GetPackBodySize());
  if (bytes.size() != size + body) return nullptr;
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + size, body);
  if ((message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) return nullptr;
  return message;
}

/// [s]
inline double time_of(igtl::MessageBase& message) {
  unsigned seconds = 0;
  unsigned fraction = 0;
  message.GetTimeStamp(&seconds, &fraction);
  return seconds + std::ldexp(static_cast<double>(fraction), -32);
}

/// A client that reads one message after the other.
class IgtlReader {
 public:
  explicit IgtlReader(int port) {
    EXPECT_EQ(socket_->ConnectToServer("127.0.0.1", port), 0);
    socket_->SetReceiveTimeout(60'000);
  }

  void say(const std::string& bytes) { socket_->Send(bytes.data(), static_cast<int>(bytes.size())); }

  /// The next message, empty at the end.
  std::string read() {
    auto header = igtl::MessageHeader::New();
    header->InitPack();
    std::string bytes(static_cast<std::size_t>(header->GetPackSize()), '\0');
    if (!receive(bytes.data(), bytes.size())) return "";
    std::memcpy(header->GetPackPointer(), bytes.data(), bytes.size());
    header->Unpack();
    const std::size_t begin = bytes.size();
    const auto body = static_cast<std::size_t>(header->GetBodySizeToRead());
    bytes.resize(begin + body);
    return receive(bytes.data() + begin, body) ? bytes : "";
  }

  /// The next message of a kind, null at the end.
  template <class Message>
  typename Message::Pointer next() {
    for (;;) {
      const std::string bytes = read();
      if (bytes.empty()) return nullptr;
      if (typename Message::Pointer message = unpack<Message>(bytes)) return message;
    }
  }

 private:
  bool receive(char* to, std::size_t size) {
    while (size > 0) {
      const int got = socket_->Receive(to, static_cast<int>(size));
      if (got <= 0) return false;
      to += got;
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }

  igtl::ClientSocket::Pointer socket_ = igtl::ClientSocket::New();
};

}  // namespace palpate::test
