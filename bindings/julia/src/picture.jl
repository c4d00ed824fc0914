# Pictures that Julia's displays show.

"""
    MJEnv.Picture(pixels)

A picture that `display` shows as an image, in notebooks and editors for instance. Its field `pixels` is what
[`render`](@ref) returns: an `Array{UInt8,3}` of size (3, height, width).
"""
struct Picture
    pixels::Array{UInt8,3}
end

Base.show(io::IO, p::Picture) = print(io, "MJEnv.Picture(", size(p.pixels, 3), " × ", size(p.pixels, 2), " pixels)")

# A PNG file: https://www.w3.org/TR/png. Its pixels are stored without compression, which needs no other package.
function Base.show(io::IO, ::MIME"image/png", p::Picture)
    _, height, width = size(p.pixels)
    header = [big_endian(width); big_endian(height); 0x08; 0x02; 0x00; 0x00; 0x00]  # 8 bits a channel, RGB
    # Each line of pixels begins with the number of its filter: none.
    lines = [zeros(UInt8, 1, height); reshape(permutedims(p.pixels, (1, 3, 2)), :, height)]
    write(io, 0x89, "PNG\r\n", 0x1a, '\n')
    png_chunk(io, "IHDR", header)
    png_chunk(io, "IDAT", zlib_stored(vec(lines)))
    png_chunk(io, "IEND", UInt8[])
    return
end

big_endian(number) = reinterpret(UInt8, [hton(UInt32(number))])
little_endian(number) = reinterpret(UInt8, [htol(UInt16(number))])

function png_chunk(io, kind, data)
    body = [Vector{UInt8}(kind); data]
    write(io, big_endian(length(data)), body, big_endian(crc32(body)))
end

# Blocks of zlib's format that hold their bytes as they are.
function zlib_stored(data)
    stream = UInt8[0x78, 0x01]
    for first in 1:65535:length(data)
        last = min(first + 65534, length(data))
        count = UInt16(last - first + 1)
        append!(stream, [UInt8(last == length(data)); little_endian(count); little_endian(~count)])
        append!(stream, view(data, first:last))
    end
    return append!(stream, big_endian(adler32(data)))
end

function adler32(data)
    a, b = UInt32(1), UInt32(0)
    for byte in data
        a = (a + byte) % UInt32(65521)
        b = (b + a) % UInt32(65521)
    end
    return b << 16 | a
end

crc32_bit(crc, _) = isodd(crc) ? crc >> 1 ⊻ 0xedb88320 : crc >> 1
crc32(data) = ~foldl((crc, byte) -> foldl(crc32_bit, 1:8; init = crc ⊻ byte), data; init = 0xffffffff)
