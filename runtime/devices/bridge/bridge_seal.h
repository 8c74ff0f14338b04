/* The seal of a datagram: HMAC-SHA-256 (FIPS 198-1, 180-4) under the runtime's key, cut to 8 bytes. Who does
 * not have the key can make none. Python: hmac.new(key, datagram[:-8], "sha256").digest()[:8]. C99 and C++.
 */
#ifndef PALPATE_BRIDGE_SEAL_H
#define PALPATE_BRIDGE_SEAL_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { BRIDGE_KEY_BYTES = 16, BRIDGE_SEAL_BYTES = 8, BRIDGE_HASH_BYTES = 32, BRIDGE_BLOCK_BYTES = 64 };

static inline uint32_t bridge_rotate(uint32_t x, int by) {
  return (x >> by) | (x << (32 - by));
}

/* One block of SHA-256. */
static inline void bridge_hash_block(uint32_t state[8], const uint8_t* block) {
  static const uint32_t K[64] = {
      0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
      0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
      0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
      0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
      0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
      0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
      0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
      0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};
  uint32_t w[64], s[8];
  for (int t = 0; t < 16; ++t)
    w[t] = (uint32_t)block[4 * t] << 24 | (uint32_t)block[4 * t + 1] << 16 | (uint32_t)block[4 * t + 2] << 8 |
           (uint32_t)block[4 * t + 3];
  for (int t = 16; t < 64; ++t) {
    const uint32_t a = w[t - 15], b = w[t - 2];
    w[t] = w[t - 16] + (bridge_rotate(a, 7) ^ bridge_rotate(a, 18) ^ a >> 3) + w[t - 7] +
           (bridge_rotate(b, 17) ^ bridge_rotate(b, 19) ^ b >> 10);
  }
  for (int k = 0; k < 8; ++k) s[k] = state[k];
  for (int t = 0; t < 64; ++t) {
    const uint32_t high = s[7] +
                          (bridge_rotate(s[4], 6) ^ bridge_rotate(s[4], 11) ^ bridge_rotate(s[4], 25)) +
                          ((s[4] & s[5]) ^ (~s[4] & s[6])) + K[t] + w[t];
    const uint32_t low = (bridge_rotate(s[0], 2) ^ bridge_rotate(s[0], 13) ^ bridge_rotate(s[0], 22)) +
                         ((s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]));
    for (int k = 7; k > 0; --k) s[k] = s[k - 1];
    s[4] += high;
    s[0] = high + low;
  }
  for (int k = 0; k < 8; ++k) state[k] += s[k];
}

/* SHA-256. */
static inline void bridge_hash(const uint8_t* bytes, size_t size, uint8_t hash[BRIDGE_HASH_BYTES]) {
  uint32_t state[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                       0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  size_t done = 0;
  for (; size - done >= BRIDGE_BLOCK_BYTES; done += BRIDGE_BLOCK_BYTES)
    bridge_hash_block(state, bytes + done);
  const size_t left = size - done, tail = left < 56 ? BRIDGE_BLOCK_BYTES : 2 * BRIDGE_BLOCK_BYTES;
  uint8_t end[2 * BRIDGE_BLOCK_BYTES] = {0};
  if (left > 0) memcpy(end, bytes + done, left);
  end[left] = 0x80;
  for (int k = 0; k < 8; ++k) end[tail - 1 - (size_t)k] = (uint8_t)((uint64_t)size * 8 >> (8 * k));
  for (size_t at = 0; at < tail; at += BRIDGE_BLOCK_BYTES) bridge_hash_block(state, end + at);
  for (int k = 0; k < BRIDGE_HASH_BYTES; ++k) hash[k] = (uint8_t)(state[k / 4] >> (24 - 8 * (k % 4)));
}

/* The first 8 bytes of HMAC-SHA-256 of `size` bytes, at most 160. */
static inline void bridge_code(const uint8_t key[BRIDGE_KEY_BYTES], const uint8_t* bytes, size_t size,
                               uint8_t code[BRIDGE_SEAL_BYTES]) {
  uint8_t inner[BRIDGE_BLOCK_BYTES + 160] = {0}, outer[BRIDGE_BLOCK_BYTES + BRIDGE_HASH_BYTES] = {0};
  for (int k = 0; k < BRIDGE_BLOCK_BYTES; ++k) {
    const uint8_t of_key = k < BRIDGE_KEY_BYTES ? key[k] : 0;
    inner[k] = of_key ^ 0x36;
    outer[k] = of_key ^ 0x5c;
  }
  memcpy(inner + BRIDGE_BLOCK_BYTES, bytes, size);
  bridge_hash(inner, BRIDGE_BLOCK_BYTES + size, outer + BRIDGE_BLOCK_BYTES);
  bridge_hash(outer, sizeof outer, inner);
  memcpy(code, inner, BRIDGE_SEAL_BYTES);
}

/* Makes the last 8 bytes of a datagram its seal. */
static inline void bridge_seal(const uint8_t key[BRIDGE_KEY_BYTES], uint8_t* datagram, size_t size) {
  bridge_code(key, datagram, size - BRIDGE_SEAL_BYTES, datagram + size - BRIDGE_SEAL_BYTES);
}

/* Whether they are that. Takes as long wherever they differ. */
static inline int bridge_is_sealed(const uint8_t key[BRIDGE_KEY_BYTES], const uint8_t* datagram,
                                   size_t size) {
  uint8_t code[BRIDGE_SEAL_BYTES], difference = 0;
  bridge_code(key, datagram, size - BRIDGE_SEAL_BYTES, code);
  for (size_t k = 0; k < BRIDGE_SEAL_BYTES; ++k)
    difference = (uint8_t)(difference | (code[k] ^ datagram[size - BRIDGE_SEAL_BYTES + k]));
  return difference == 0;
}

#endif
