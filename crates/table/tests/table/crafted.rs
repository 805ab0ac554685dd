//! Small files that ask for gigabytes or hours are refused for what they ask.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::Encoding;
use parquet::data_type::{ByteArray, ByteArrayType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use standstill_table::{Column, Kind, Reader};
use tempfile::TempDir;

/// What a file claims; as it stands, a column `x` of three rows with numbers.
struct Claims {
    rows: i64,
    groups: usize,
    page: Page,
    columns: i64,
    /// Levels of the schema below the column's.
    levels: usize,
    /// Fields of the footer behind all others.
    further: Vec<u8>,
}

/// The only page.
#[derive(Clone)]
struct Page {
    kind: i64,
    values: i64,
    unpacked: i64,
    codec: i64,
    /// Fields of the head behind all others.
    further: Vec<u8>,
    bytes: Vec<u8>,
}

impl Default for Claims {
    fn default() -> Self {
        // Levels: four bytes of length, a run of three that are present. Then the numbers.
        let mut bytes = vec![2, 0, 0, 0, 3 << 1, 1];
        bytes.extend([0.5_f64, 1.5, 2.5].iter().flat_map(|x| x.to_le_bytes()));
        let page = Page { kind: 0, values: 3, unpacked: 30, codec: 0, further: Vec::new(), bytes };
        Self { rows: 3, groups: 1, page, columns: 1, levels: 0, further: Vec::new() }
    }
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 127 {
        bytes.push(u8::try_from(number & 127).expect("seven bits") | 128);
        number >>= 7;
    }
    bytes.push(u8::try_from(number).expect("seven bits"));
    bytes
}

/// A field so far behind the last one: of 32 bits, of 64 bits, of bytes, a list of so many elements of a kind, a structure.
fn whole(step: u8, number: i64) -> Vec<u8> {
    [vec![(step << 4) + 5], varint(((number << 1) ^ (number >> 63)).cast_unsigned())].concat()
}

fn long(step: u8, number: i64) -> Vec<u8> {
    [vec![(step << 4) + 6], whole(step, number)[1..].to_vec()].concat()
}

fn text(step: u8, text: &[u8]) -> Vec<u8> {
    [vec![(step << 4) + 8], varint(text.len() as u64), text.to_vec()].concat()
}

fn list(step: u8, kind: u8, count: u64, elements: &[u8]) -> Vec<u8> {
    [vec![(step << 4) + 9, 0xf0 + kind], varint(count), elements.to_vec()].concat()
}

fn structure(step: u8, fields: &[Vec<u8>]) -> Vec<u8> {
    [vec![(step << 4) + 12], fields.concat(), vec![0]].concat()
}

fn file(claims: &Claims) -> Vec<u8> {
    let Page { kind, values, unpacked, codec, further, bytes } = &claims.page;
    let length = i64::try_from(bytes.len()).expect("small");
    let about = match kind {
        2 => structure(4, &[whole(1, *values), whole(1, 0)]),
        _ => structure(2, &[whole(1, *values), whole(1, 0), whole(1, 3), whole(1, 3)]),
    };
    let head =
        [whole(1, *kind), whole(1, *unpacked), whole(1, length), about, further.clone(), vec![0]].concat();
    let chunk = [b"PAR1".to_vec(), head, bytes.clone()].concat();
    let size = i64::try_from(chunk.len() - 4).expect("small");
    let leaf = |name: &[u8]| [whole(1, 5), whole(2, 1), text(1, name), vec![0]].concat();
    let group = [whole(3, 1), text(1, b"g"), whole(1, 1), vec![0]].concat();
    let root = [text(4, b"table"), whole(1, claims.columns), vec![0]].concat();
    let schema = [root, group.repeat(claims.levels), leaf(b"x")].concat();
    let column = [
        whole(1, 5),
        list(1, 5, 1, &[0]),
        list(1, 8, 1, &text(0, b"x")[1..]),
        whole(1, *codec),
        long(1, claims.rows),
        long(1, size),
        long(1, size),
        long(2, 4),
    ];
    let column = [long(2, 4), structure(1, &column), vec![0]].concat();
    let group = [list(1, 12, 1, &column), long(1, size), long(1, claims.rows), vec![0]].concat();
    let groups = claims.groups as u64;
    let footer = [
        whole(1, 1),
        list(1, 12, claims.levels as u64 + 2, &schema),
        long(1, claims.rows),
        list(1, 12, groups, &group.repeat(claims.groups)),
        claims.further.clone(),
        vec![0],
    ]
    .concat();
    let length = u32::try_from(footer.len()).expect("small").to_le_bytes();
    [chunk, footer, length.to_vec(), b"PAR1".to_vec()].concat()
}

/// The first column of a file with these bytes, or the message without the file's name.
fn read(name: &str, bytes: &[u8], kind: Kind) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the folder takes files");
    read_at(&folder, &path, kind)
}

fn read_at(folder: &TempDir, path: &Path, kind: Kind) -> Result<Vec<String>, String> {
    let mut rows = Vec::new();
    let read = Reader::open(path).and_then(|reader| {
        let column = Column::new(reader.columns[0].clone(), kind);
        reader.values(&[column], |cells| rows.push(format!("{:?}", cells[0])))
    });
    read.map(|()| rows)
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn law_a_small_file_cannot_ask_for_much() {
    let page = Claims::default().page;
    let plain = read("t.parquet", &file(&Claims::default()), Kind::Number);
    assert_eq!(plain, Ok(["Number(0.5)", "Number(1.5)", "Number(2.5)"].map(str::to_owned).to_vec()));
    let most = i64::from(i32::MAX);
    // A list of as many flags, each of which takes no bytes for some readers.
    let flags = list(1, 1, most.cast_unsigned(), &[]).repeat(8);
    // A structure within the head of the page with a text of a terabyte.
    let statistics = [vec![0x1c, 0x18], varint(1 << 40), vec![0]].concat();
    let of = |page: Page| Claims { page, ..Claims::default() };
    let cases = [
        (Claims { rows: most, ..of(Page { values: most, ..page.clone() }) }, "2147483647 rows in"),
        (Claims { rows: -1, ..Claims::default() }, "an impossible number of rows in"),
        (of(Page { values: most, ..page.clone() }), "a page of 2147483647 values in a group of 3 rows"),
        (of(Page { values: 2, ..page.clone() }), "2 values in 3 rows"),
        (
            of(Page { unpacked: most, codec: 1, ..page.clone() }),
            "a page of 30 bytes that unpacks to 2147483647",
        ),
        (of(Page { kind: 2, values: most, ..page.clone() }), "a dictionary of 2147483647 values in 30 bytes"),
        (of(Page { further: flags.clone(), ..page.clone() }), "a damaged head of a page"),
        (of(Page { further: statistics, ..page.clone() }), "a damaged head of a page"),
        (Claims { columns: most, ..Claims::default() }, "2147483647 columns or metadata, 4096 at most"),
        (Claims { levels: 200_000, ..Claims::default() }, "columns within columns"),
        (Claims { groups: 20, ..Claims::default() }, "row groups that share their bytes"),
        (Claims { further: flags, ..Claims::default() }, "a damaged footer"),
        // Lists within lists.
        (Claims { further: vec![0x19; 1 << 20], ..Claims::default() }, "a damaged footer"),
    ];
    for (claims, expected) in cases {
        let message = read("t.parquet", &file(&claims), Kind::Number).expect_err(expected);
        assert!(message.starts_with("t.parquet: ") && message.contains(expected), "{expected}: {message}");
    }
}

/// A file of one text in so many rows.
fn texts(text: &str, rows: usize, properties: WriterProperties) -> Vec<u8> {
    let schema = parse_message_type("message m { required binary x (STRING); }").expect("a schema");
    let mut file =
        SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties)).expect("a file");
    let mut group = file.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("the first");
    let text = ByteArray::from(text);
    column.typed::<ByteArrayType>().write_batch(&vec![text; rows], None, None).expect("values");
    column.close().expect("complete");
    group.close().expect("complete");
    file.into_inner().expect("memory takes everything")
}

#[test]
fn law_texts_unpack_to_what_a_table_may_have() {
    let plain = WriterProperties::builder().build();
    let short = read("t.parquet", &texts("found", 5000, plain.clone()), Kind::Text).expect("a table");
    assert_eq!(short, vec!["Text(\"found\")"; 5000]);
    // A dictionary of one text, which stands in each row.
    let long = read("t.parquet", &texts(&"x".repeat(1 << 16), 8000, plain), Kind::Text);
    assert_eq!(long, Err("t.parquet: unreadable after row 0: texts that unpack to too much".to_owned()));
    // Each text as that before it and a little more.
    let alike =
        WriterProperties::builder().set_dictionary_enabled(false).set_encoding(Encoding::DELTA_BYTE_ARRAY);
    let alike = read("t.parquet", &texts("found", 9, alike.build()), Kind::Text);
    let encoding =
        "values in the encoding DELTA_BYTE_ARRAY, needed one of PLAIN, PLAIN_DICTIONARY, RLE_DICTIONARY";
    assert_eq!(alike, Err(format!("t.parquet: unreadable after row 0: {encoding}")));
}

#[test]
fn law_a_row_of_a_csv_file_has_an_end() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("t.csv");
    let file = std::fs::File::create(&path).expect("made");
    // Of zeros, which take no room on the disk.
    file.set_len(3 << 30).expect("room");
    let message = read_at(&folder, &path, Kind::Number).expect_err("no table");
    assert!(message.contains("a row of more than 16 MiB, which no table has"), "{message}");
}
